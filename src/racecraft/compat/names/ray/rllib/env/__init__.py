"""`ray.rllib.env`."""

from racecraft.compat.names.ray.rllib.env.base_env import BaseEnv
from racecraft.compat.names.ray.rllib.env.multi_agent_env import MultiAgentEnv

__all__ = ["BaseEnv", "MultiAgentEnv"]
