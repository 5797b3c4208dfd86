"""`ray.rllib.policy`."""

from racecraft.compat.names.ray.rllib.policy.policy import Policy, PolicySpec

__all__ = ["Policy", "PolicySpec"]
