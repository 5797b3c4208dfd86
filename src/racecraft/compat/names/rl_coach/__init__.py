"""`rl_coach` as far as presets lay values into it; nothing of Coach runs. See `racecraft.compat.coach_config`."""
