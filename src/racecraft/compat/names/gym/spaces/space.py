"""`gym.spaces.space`."""

from gymnasium.spaces import Space

__all__ = ["Space"]
