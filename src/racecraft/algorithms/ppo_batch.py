"""What PPO learns from: a rollout once it was judged, and the minibatches that are drawn of it."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

from racecraft.algorithms.recurrent_network import Sequences
from racecraft.contract.world import Array


@dataclass(frozen=True)
class Advantages:
    """How good every decision of a rollout was. Each float32 (T, R)."""

    values: Array
    """What the critic expected."""
    advantages: Array
    """How much better it came, not standardised."""
    targets: Array
    """What the critic should have expected."""
    log_prob: Array
    """How likely the decision was."""
    weights: Array | None = None
    """How much it counts, where older weights took it; None: all alike."""


@dataclass
class Minibatch:
    """B transitions, as tensors on the learner's device."""

    observations: dict[str, Tensor]
    raw_actions: Tensor
    log_prob: Tensor
    advantages: Tensor
    targets: Tensor
    action_mask: Tensor | None = None
    weights: Tensor | None = None
    """How much each decision counts, where older weights took it; None: all alike."""
    sequences: Sequences | None = None
    """How the observations hang together, for a policy with a memory; there are more of them than of the rest then."""

    def take(self, rows: Tensor) -> Minibatch:
        """Return the chosen rows (int64 (B,))."""
        return Minibatch(
            observations={name: numbers.index_select(0, rows) for name, numbers in self.observations.items()},
            raw_actions=self.raw_actions.index_select(0, rows),
            log_prob=self.log_prob.index_select(0, rows),
            advantages=self.advantages.index_select(0, rows),
            targets=self.targets.index_select(0, rows),
            action_mask=None if self.action_mask is None else self.action_mask.index_select(0, rows),
            weights=None if self.weights is None else self.weights.index_select(0, rows),
        )
