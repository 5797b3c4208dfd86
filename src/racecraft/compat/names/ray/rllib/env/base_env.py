"""`ray.rllib.env.base_env`: what callbacks are told of."""

from racecraft.compat.rllib_callbacks import Worlds as BaseEnv

__all__ = ["BaseEnv"]
