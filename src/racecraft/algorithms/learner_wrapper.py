"""What is laid round a learner and decides as it does: a bonus (`intrinsic.py`), imitation (`imitation.py`)."""

from __future__ import annotations

from collections.abc import Mapping

import torch

from racecraft.algorithms.learner import Decision, HasSchedules, Learner, greedy_policy_of
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, ArraySpec


class LearnerWrapper:
    """Hands on to an inner learner whatever has nothing to do with learning.

    Args:
        inner: Who decides.
    """

    def __init__(self, inner: Learner) -> None:
        self.inner, self.spec = inner, inner.spec
        self.experience, self.device = inner.experience, inner.device

    @property
    def columns(self) -> Mapping[str, ArraySpec]:
        """What the inner learner notes."""
        return self.inner.columns

    @property
    def policy_spec(self) -> PolicySpec:
        """The inner learner's."""
        return self.inner.policy_spec

    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Decide as the inner learner does."""
        return self.inner.act(observations, action_mask, generator=generator, rows=rows)

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        self.inner.reset_state(rows)

    def choose(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return greedy actions."""
        return self.inner.choose(observations, action_mask)

    def greedy_policy(self) -> Policy:
        """Return the inner learner's."""
        return greedy_policy_of(self.inner)

    def anneal(self, done: float) -> None:
        """Follow the inner learner's schedules."""
        if isinstance(self.inner, HasSchedules):
            self.inner.anneal(done)
