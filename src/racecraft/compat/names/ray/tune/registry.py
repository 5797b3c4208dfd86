"""`ray.tune.registry`."""

from racecraft.compat.own_trainables import register_trainable
from racecraft.compat.rllib_training import register_env

__all__ = ["register_env", "register_trainable"]
