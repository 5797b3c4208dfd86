"""PPO whose rollout stays in shards, where it was collected, on one page. Begin with `AveragingPpo.update`.

A shard keeps its rows, says how good their decisions were, and finds the gradients of its part of every minibatch.
Which rows a minibatch holds is drawn once over all rows, whoever has them; advantages are standardised over all of it.
Sums of gradients are added, divided by the rows, cut and stepped in one place. So shards learn from the minibatches
that one process learns from, to the same weights but for the rounding of sums, and what was seen never travels.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from racecraft.algorithms.laid_round import LaidRound
from racecraft.algorithms.learner import StateDict
from racecraft.algorithms.ppo import VALUE, PpoLearner, facts_of
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.algorithms.weights import to_arrays, to_tensors
from racecraft.contract.world import Array

ADVANTAGE, TARGET = "advantage", "target"
"""Columns of a rollout whose observations stay where they are, beside `VALUE`."""


@dataclass(frozen=True)
class Drawn:
    """A minibatch, as every shard is told of it."""

    weights: Mapping[str, Array]
    """Of the network now."""
    rows: Array
    """int64 (B,): t * R + r, counted over the rows of all shards side by side."""
    centre: float
    """What is taken from each advantage, which is then divided by the deviation."""
    deviation: float
    clip: float
    """As its schedule has it by now; likewise the entropy's weight."""
    entropy_weight: float


@dataclass(frozen=True)
class Found:
    """What a shard found of a minibatch: sums over its own rows."""

    count: int
    """Of its rows."""
    gradients: Mapping[str, Array]
    """float32 by the names of the weights; empty where the shard has none of the rows."""
    figures: Array
    """float32 (5,): policy loss, value loss, entropy, approximate KL, clipped share."""
    seconds: float
    """Spent on it."""


class PpoShard:
    """Keeps the latest rollout of some rows, and finds gradients in it.

    Args:
        learner: Whose weights are taken over; it takes no step.
        first: Which of all rows is the first here.
        width: How many rows there are in all.
    """

    def __init__(self, learner: PpoLearner, first: int, width: int) -> None:
        self._learner, self._first, self._width = learner, first, width

    def take(self, batch: RolloutBatch) -> RolloutBatch:
        """Keep a rollout, until the next; return it without what was seen, with how good every decision was."""
        judged = self._learner.judged(batch)
        self._whole, self._rows = self._learner.laid(batch, judged), batch.shape[1]
        return replace(
            batch,
            observations={},
            last_observations={},
            final_observations={},
            final_index=np.zeros(0, np.int64),
            action_mask=None,
            last_action_mask=None,
            columns={ADVANTAGE: judged.advantages, TARGET: judged.targets, VALUE: judged.values},
        )

    def find(self, drawn: Drawn) -> Found:
        """Find the gradients of those rows of a minibatch that are here."""
        began, learner = time.perf_counter(), self._learner
        rows = self._own(drawn.rows)
        if not len(rows):
            return Found(0, {}, np.zeros(5, np.float32), time.perf_counter() - began)
        learner.load_state_dict({"network": to_tensors(dict(drawn.weights))})
        part = self._whole.take(torch.from_numpy(rows).to(learner.device))
        part.advantages = (part.advantages - drawn.centre) / drawn.deviation
        now = replace(learner.config, clip=drawn.clip, entropy_weight=drawn.entropy_weight, standardise="none")
        figures = learner.find_gradients(part, now, times=len(rows)) * len(rows)
        gradients = {name: one.grad for name, one in learner.network.named_parameters() if one.grad is not None}
        return Found(len(rows), to_arrays(gradients), to_arrays(figures), time.perf_counter() - began)

    def _own(self, rows: Array) -> Array:
        """Return where those of all rows that are here lie, in their order."""
        ticks, owners = np.divmod(rows, self._width)
        places = owners - self._first
        here = (places >= 0) & (places < self._rows)
        found: Array = (ticks * self._rows + places)[here]
        return found


class AveragingPpo(LaidRound):
    """A learner that is fed rollouts without what was seen, and has shards find its gradients.

    Towards everybody it is the learner within.

    Args:
        inner: Draws the minibatches and takes the steps.
        ask: Asks every shard about a minibatch; returns what they found, always in the same order.
    """

    inner: PpoLearner

    def __init__(self, inner: PpoLearner, ask: Callable[[Drawn], Sequence[Found]]) -> None:
        super().__init__(inner)
        self.figures, self._ask = inner.figures, ask

    def update(self, experience: RolloutBatch) -> dict[str, float]:
        """Learn from a rollout that `PpoShard.take` gave, all shards side by side; return `PpoLearner`'s figures.

        Raises:
            DivergedError: A loss is no longer a number.
        """
        inner, active = self.inner, experience.active
        value, found, target = (experience.columns[name] for name in (VALUE, ADVANTAGE, TARGET))
        used = found[active]
        advantages = torch.from_numpy(found.reshape(-1)).to(inner.device)
        rows = torch.from_numpy(np.flatnonzero(active)).to(inner.device)
        steps = [self._step(picked, *self._scale(used, advantages[picked])) for picked in inner.drawn(rows)]
        return inner.told(steps, facts_of(value[active], used, target[active]), len(rows))

    def state_dict(self) -> StateDict:
        """Return the inner learner's: shards hold nothing that outlasts an update."""
        return self.inner.state_dict()

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent (weights alone)."""
        self.inner.load_state_dict(state)

    def _scale(self, rollout: Array, minibatch: Tensor) -> tuple[float, float]:
        """Return what is taken from advantages, and by what they are divided then."""
        over = self.inner.config.standardise
        if over == "minibatch" and len(minibatch) > 1:
            return float(minibatch.mean()), float(minibatch.std() + 1e-8)
        if over == "rollout" and len(rollout) > 1:
            return float(rollout.mean()), float(rollout.std() + 1e-8)
        return 0.0, 1.0

    def _step(self, picked: Tensor, centre: float, deviation: float) -> Tensor:
        """Take one gradient step and return its figures, in the order of `FIGURES`."""
        inner = self.inner
        weights = to_arrays(inner.network.state_dict())
        now = inner.now
        parts = self._ask(Drawn(weights, picked.cpu().numpy(), centre, deviation, now.clip, now.entropy_weight))
        assert sum(part.count for part in parts) == len(picked), "every row is in one shard"
        for name, one in inner.network.named_parameters():
            sums = [part.gradients[name] for part in parts if name in part.gradients]
            one.grad = torch.from_numpy(added(sums) / len(picked)).to(one.device) if sums else None
        figures = torch.from_numpy(added([part.figures for part in parts]) / len(picked)).to(inner.device)
        return torch.cat([figures, inner.descend().reshape(1)])


def added(arrays: Sequence[Array]) -> Array:
    """Return the sum of arrays, added one after the other; its memory is its own.

    >>> added([np.ones(2, np.float32), np.ones(2, np.float32)])
    array([2., 2.], dtype=float32)
    """
    total = np.array(arrays[0])
    for one in arrays[1:]:
        total += one
    return total
