"""What is laid round a learner and is one itself; it hands on what it has no say in.

Stacks (`stacking.py`), a bonus (`intrinsic.py`), imitation (`imitation.py`), a mean of its weights (`averaging.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

import torch

from racecraft.algorithms.learner import Decision, HasSchedules, Learner, greedy_policy_of
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.replay_sampler import ReplayLearner
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
        self.figures: Mapping[str, str] = getattr(inner, "figures", {})

    @property
    def discount(self) -> float:
        """Weight of the next tick's value (gamma), of a learner that eats from a replay."""
        return cast(ReplayLearner, self.inner).discount

    @property
    def n_step(self) -> int:
        """Steps of reward before a value is asked for, likewise."""
        return cast(ReplayLearner, self.inner).n_step

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
