"""`gym.envs.classic_control.continuous_mountain_car`."""

from gymnasium.envs.classic_control.continuous_mountain_car import Continuous_MountainCarEnv as New

from racecraft.compat.names.gym import with_old_manners

Continuous_MountainCarEnv = with_old_manners(New)

__all__ = ["Continuous_MountainCarEnv"]
