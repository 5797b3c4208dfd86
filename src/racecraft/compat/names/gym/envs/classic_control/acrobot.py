"""`gym.envs.classic_control.acrobot`."""

from gymnasium.envs.classic_control.acrobot import AcrobotEnv as New

from racecraft.compat.names.gym import with_old_manners

AcrobotEnv = with_old_manners(New)

__all__ = ["AcrobotEnv"]
