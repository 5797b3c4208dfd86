"""Gymnasium's spaces under their old name."""

from gymnasium.spaces import Dict, Discrete, MultiBinary, MultiDiscrete, Space, Tuple

from racecraft.compat.names.gym.spaces import space
from racecraft.compat.names.gym.spaces.box import Box

__all__ = ["Box", "Dict", "Discrete", "MultiBinary", "MultiDiscrete", "Space", "Tuple", "space"]
