"""A bonus laid on the world's reward before a learner learns. Begin with `IntrinsicReward`.

    reward + strength * bonus / running deviation of the bonus's discounted sum      for what is new
    reward + strength * bonus                                                        for what is like what was shown

What a bonus is, a `RewardModel` says: `curiosity.py`, `rnd.py` and `gail.py` have one each. The bonus is plainly added
and meets the learner's own discount and critic; the two heads with two discounts of Burda et al. are left out. A tick
that ends the story earns none for novelty: what is shown after it belongs to another episode. What the training tells
as reward stays the world's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor

from racecraft.algorithms.learner import REPLAY, Learner, StateDict
from racecraft.algorithms.learner_wrapper import LearnerWrapper
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array

BONUS_DISCOUNT = 0.99
"""Of the sums whose deviation the bonus is measured by, as in Burda et al."""


class RewardModel(Protocol):
    """Says what a transition is worth beside the world's reward, and learns from it."""

    name: str
    """Of its group of settings, and of its figures and its state."""
    strength: float
    is_novelty: bool
    """Whether the bonus is for what is new after an action: it is measured by its own deviation then, and a tick with
    nothing after it earns none."""
    figures: Mapping[str, str]

    def bonus(self, before: Mapping[str, Array], actions: Array, after: Mapping[str, Array]) -> Array:
        """Return the bonus of each of B transitions, float32 (B,), 0 or more."""
        ...

    def learn(self, before: Mapping[str, Array], actions: Array, after: Mapping[str, Array]) -> dict[str, float]:
        """Learn from B transitions; return figures."""
        ...

    def state_dict(self) -> dict[str, Tensor]:
        """Return everything as named tensors (copies)."""
        ...

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Go on from what `state_dict` gave."""
        ...


class IntrinsicReward(LearnerWrapper):
    """A learner that is rewarded by more than the world. Towards everybody it is that learner.

    Args:
        inner: Learns from rollouts.
        model: Says for what.

    Raises:
        SettingError: The learner eats from a replay, whose rewards were laid down long ago.
    """

    def __init__(self, inner: Learner, model: RewardModel) -> None:
        if inner.experience == REPLAY:
            raise SettingError(
                "{name}.strength is {strength:g}; its bonus is of the latest rollout, and this algorithm "
                "learns from a replay. Leave it at 0, or use ppo.",
                name=model.name,
                strength=model.strength,
            )
        super().__init__(inner)
        self.model = model
        self.figures = {
            **self.figures,
            f"{model.name}_reward": "Mean bonus of a transition, its strength and scale in, in reward units.",
            **model.figures,
        }
        self.scale = ReturnScale(BONUS_DISCOUNT)

    def update(self, experience: RolloutBatch) -> dict[str, float]:
        """Add the bonus to what is rewarded, have the learner learn, then the model."""
        worth = experience.active & ~experience.terminated if self.model.is_novelty else experience.active
        chosen = np.flatnonzero(worth.reshape(-1))
        before, actions, after = transitions(experience, chosen)
        raw = np.zeros(experience.reward.shape, np.float32)
        if len(chosen):
            raw.reshape(-1)[chosen] = self.model.bonus(before, actions, after)
        added = self.model.strength * raw / (self.scale.measured(raw) if self.model.is_novelty else 1.0)
        metrics: Mapping[str, Any] = self.inner.update(replace(experience, reward=experience.reward + added))
        learned = self.model.learn(before, actions, after) if len(chosen) else {}
        mean = float(added[experience.active].mean()) if experience.num_active else 0.0
        return {**metrics, f"{self.model.name}_reward": mean, **learned}

    def state_dict(self) -> StateDict:
        """Return the inner learner's state and, in a group of its own, the model's."""
        own = {**self.model.state_dict(), **{f"scale/{name}": part for name, part in self.scale.state().items()}}
        return {**self.inner.state_dict(), self.model.name: own}

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent."""
        self.inner.load_state_dict(state)
        if own := state.get(self.model.name):
            self.model.load_state_dict({name: part for name, part in own.items() if not name.startswith("scale/")})
            self.scale.restore({name[6:]: part for name, part in own.items() if name.startswith("scale/")})


class ReturnScale:
    """The running deviation of a reward's discounted sums, by which it is measured.

    Args:
        discount: Of the sums; they run on through the ends of episodes, as in Burda et al.
    """

    def __init__(self, discount: float) -> None:
        self.discount = discount
        self.sums = np.zeros(0)
        self.moments = RunningMoments(())

    def measured(self, reward: Array) -> float:
        """Take in a rollout's rewards (T, R) and return the deviation so far, above 0."""
        if len(self.sums) != reward.shape[1]:
            self.sums = np.zeros(reward.shape[1])
        sums = np.empty(reward.shape)
        for tick, row in enumerate(reward):
            self.sums = sums[tick] = self.discount * self.sums + row
        self.moments.add(sums.reshape(-1))
        return float(np.sqrt(self.moments.variance) + 1e-8)

    def state(self) -> dict[str, Tensor]:
        """Return everything as named tensors (copies)."""
        return {"sums": torch.from_numpy(self.sums.copy()), **self.moments.state()}

    def restore(self, state: Mapping[str, Tensor]) -> None:
        """Go on from what `state` gave."""
        self.sums = state["sums"].numpy().copy()
        self.moments.restore(state)


class RunningMoments:
    """Mean and variance of all rows seen so far, float64 of the given shape."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.count = 0.0
        self.mean, self.variance = np.zeros(shape), np.ones(shape)

    def add(self, rows: Array) -> None:
        """Take in rows (B, *shape); Chan et al.'s way to join two lots."""
        if not len(rows):
            return
        count, mean, variance = len(rows), rows.mean(axis=0), rows.var(axis=0)
        whole, apart = self.count + count, mean - self.mean
        spread = self.variance * self.count + variance * count + apart**2 * self.count * count / whole
        self.mean = self.mean + apart * count / whole
        self.variance, self.count = spread / whole, whole

    def state(self) -> dict[str, Tensor]:
        """Return everything as named tensors (copies)."""
        parts = {"count": self.count, "mean": self.mean, "variance": self.variance}
        return {name: torch.tensor(np.array(part)) for name, part in parts.items()}

    def restore(self, state: Mapping[str, Tensor]) -> None:
        """Go on from what `state` gave."""
        self.count = float(state["count"])
        self.mean, self.variance = state["mean"].numpy().copy(), state["variance"].numpy().copy()


def transitions(batch: RolloutBatch, chosen: Array) -> tuple[dict[str, Array], Array, dict[str, Array]]:
    """Return what was seen, done, and seen then, of chosen ticks.

    Args:
        batch: A rollout.
        chosen: int64 (B,), rising: t * R + r. What is seen after a tick that ended the story is another's beginning.
    """
    before, after = {}, {}
    cut = np.isin(batch.final_index, chosen)
    at = np.searchsorted(chosen, batch.final_index[cut])
    for name, seen in batch.observations.items():
        flat = seen.reshape(-1, *seen.shape[2:])
        before[name] = flat[chosen]
        then = np.concatenate([flat[seen.shape[1] :], batch.last_observations[name]])[chosen]
        if cut.any():
            then[at] = batch.final_observations[name][cut]
        after[name] = then
    return before, batch.actions.reshape(-1, *batch.actions.shape[2:])[chosen], after
