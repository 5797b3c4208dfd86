"""`ray.rllib`."""

from racecraft.compat.rllib_callbacks import Policy
from racecraft.compat.rllib_callbacks import Worlds as BaseEnv
from racecraft.compat.rllib_callbacks import Worlds as RolloutWorker

__all__ = ["BaseEnv", "Policy", "RolloutWorker"]
