"""`gym.envs`: the classic ones, as they used to be imported."""
