"""`ray.rllib.agents.callbacks`: the base of a script's own callbacks."""

from racecraft.compat.rllib_callbacks import DefaultCallbacks

__all__ = ["DefaultCallbacks"]
