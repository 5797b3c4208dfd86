"""A trained policy as a player: built from a checkpoint's weights and its card."""

from __future__ import annotations

from collections.abc import Mapping

from racecraft.algorithms.multi_policy import Learner
from racecraft.contract.world import Array


class GreedyPolicy:
    """The likeliest action of a learner's policy, every time; sees nothing privileged.

    The learner may go on learning; the policy then follows it.
    """

    def __init__(self, learner: Learner) -> None:
        self._learner = learner

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Choose an action for every row (R, …)."""
        return self._learner.choose(observations, action_mask)

    def forget(self, rows: Array) -> None:
        """Nothing is remembered from tick to tick."""
