"""`gym.envs`: the classic ones, as they used to be imported, and registration."""

from racecraft.compat.names.gym.envs.registration import make, register, registry, spec

__all__ = ["make", "register", "registry", "spec"]
