"""`ray.tune.registry`."""

from racecraft.compat.rllib_training import register_env

__all__ = ["register_env"]
