"""`gym.utils`."""

from racecraft.compat.names.gym.utils import seeding

__all__ = ["seeding"]
