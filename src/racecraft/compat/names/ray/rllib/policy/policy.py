"""`ray.rllib.policy.policy`: what a script says of one policy of several."""

from __future__ import annotations

from typing import Any, NamedTuple

from racecraft.compat.rllib_callbacks import Policy


class PolicySpec(NamedTuple):
    """One policy: None leaves a thing to the environment."""

    policy_class: Any = None
    observation_space: Any = None
    action_space: Any = None
    config: Any = None


__all__ = ["Policy", "PolicySpec"]
