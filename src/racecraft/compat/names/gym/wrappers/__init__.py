"""`gym.wrappers`: what cuts an episode."""

from racecraft.compat.names.gym.wrappers.time_limit import TimeLimit

__all__ = ["TimeLimit"]
