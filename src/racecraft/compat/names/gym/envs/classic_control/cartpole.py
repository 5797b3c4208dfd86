"""`gym.envs.classic_control.cartpole`."""

from gymnasium.envs.classic_control.cartpole import CartPoleEnv as New

from racecraft.compat.names.gym import with_old_manners

CartPoleEnv = with_old_manners(New)

__all__ = ["CartPoleEnv"]
