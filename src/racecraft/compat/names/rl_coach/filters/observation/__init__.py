"""A room of `rl_coach`."""
