"""`gym.envs.classic_control`."""

from racecraft.compat.names.gym.envs.classic_control.acrobot import AcrobotEnv
from racecraft.compat.names.gym.envs.classic_control.cartpole import CartPoleEnv
from racecraft.compat.names.gym.envs.classic_control.continuous_mountain_car import Continuous_MountainCarEnv
from racecraft.compat.names.gym.envs.classic_control.mountain_car import MountainCarEnv
from racecraft.compat.names.gym.envs.classic_control.pendulum import PendulumEnv

__all__ = ["AcrobotEnv", "CartPoleEnv", "Continuous_MountainCarEnv", "MountainCarEnv", "PendulumEnv"]
