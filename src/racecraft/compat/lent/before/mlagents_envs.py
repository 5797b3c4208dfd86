"""The door to `mlagents_envs` for a process that a script started; see `racecraft.compat.foreign`."""

from racecraft.compat.foreign import take_over

take_over(__name__)
