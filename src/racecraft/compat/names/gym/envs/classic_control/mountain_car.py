"""`gym.envs.classic_control.mountain_car`."""

from gymnasium.envs.classic_control.mountain_car import MountainCarEnv as New

from racecraft.compat.names.gym import with_old_manners

MountainCarEnv = with_old_manners(New)

__all__ = ["MountainCarEnv"]
