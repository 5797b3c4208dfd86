"""`gym_unity` as ML-Agents had it up to its Python package 0.28: `gym_unity.envs.UnityToGymWrapper`."""
