"""A Unity scene of one agent as an old-style `gym.Env`."""

from racecraft.compat.names.mlagents_envs.envs.unity_gym_env import (
    ActionFlattener,
    UnityGymException,
    UnityToGymWrapper,
)

__all__ = ["ActionFlattener", "UnityGymException", "UnityToGymWrapper"]
