"""What a learner that eats a replay is fed: transitions drawn from all that is remembered. Begin with `ReplaySampler`.

The store behind it (`rollout/replay.py`) knows no algorithm, and a learner knows no store.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import torch

from racecraft.algorithms.learner import Learner
from racecraft.contract.world import Array

VALUE_TAKEN, VALUE_BEST = "value_taken", "value_best"
"""Columns float32 (): what an actor expected of the choice it took, and of the best one. Where a learner notes both,
what is new enters a prioritised replay with the error that follows from them."""


@dataclass
class Transitions:
    """B transitions, as NumPy arrays of the learner's own (copies); every array begins with (B,).

    A target is `reward + discount * value(next_observations)`: what an end means is settled in `discount` already.
    """

    observations: dict[str, Array]
    """What was seen before acting, by name, in the world's own types."""
    actions: Array
    """What the world was told, in the type of its action spec."""
    reward: Array
    """float32: discounted sum over the steps looked ahead, n at most, fewer where the episode ended before."""
    discount: Array
    """float32: gamma to the power of those steps; 0 where the story ended. A cut by the clock keeps it."""
    next_observations: dict[str, Array]
    """What value follows from: what was seen n steps later, or the last of an episode that was cut."""
    action_mask: Array | None
    """bool (B, A), True where a choice was allowed; None where the world has no mask."""
    next_action_mask: Array | None
    """bool (B, A): likewise afterwards; all True for the last observation of an episode, of which no mask is known."""
    weights: Array
    """float32: what each counts in the loss, 1 at most; ones where all are drawn alike."""
    index: Array
    """int64: their places, for `set_priorities`."""


class ReplaySampler(Protocol):
    """All that is remembered, to be drawn from."""

    new_transitions: int
    """Transitions that the latest turn of the loop collected: gradient steps go in proportion to them."""

    prioritised: bool
    """Whether what is drawn hangs on the priorities that were set; else much may be drawn at once."""

    def __len__(self) -> int:
        """Return how many transitions may be drawn."""
        ...

    def sample(self, batch_size: int, generator: torch.Generator) -> Transitions:
        """Draw transitions, with replacement; the chance is `generator`'s alone."""
        ...

    def set_priorities(self, index: Array, errors: Array) -> None:
        """Say how wrong was what was expected of the transitions in these places.

        Args:
            index: int64 (B,), from `Transitions`.
            errors: float (B,), temporal-difference errors; their sign is ignored. Nothing happens where all are drawn
                alike.
        """
        ...


class ReplayLearner(Learner, Protocol):
    """A learner that eats from a replay."""

    discount: float
    """Weight of the next tick's value (gamma), 0 to 1."""
    n_step: int
    """Steps of reward that are summed before a value is asked for, 1 or more."""
