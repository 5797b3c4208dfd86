"""`gym.envs.classic_control.pendulum`."""

from gymnasium.envs.classic_control.pendulum import PendulumEnv as New

from racecraft.compat.names.gym import with_old_manners

PendulumEnv = with_old_manners(New)

__all__ = ["PendulumEnv"]
