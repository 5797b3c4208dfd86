"""`ray.rllib.env`."""

from racecraft.compat.names.ray.rllib.env.multi_agent_env import MultiAgentEnv

__all__ = ["MultiAgentEnv"]
