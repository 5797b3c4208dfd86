"""A policy that sees the last k observations at once. Begin with `StackedLearner` and `StackedPolicy`.

The world, its storage and its files know nothing of it: they hold every frame once. The learner's side lays frames on
each other when it decides (it keeps k - 1 of them for each row) and again when it learns, from the rollout's own
frames; a replay does so for those who draw from it (`rollout/transition_ring.py`), by the column `AGE`. The policy that
is loaded stacks by itself and takes what the world shows. Before an episode has shown k
observations, its first one stands in for those that are missing.

All that is visible is stacked, oldest first: images along their channels, everything else end to end. What is
privileged is the true state and needs no past.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from racecraft.algorithms.explainable import Scores
from racecraft.algorithms.learner import REPLAY, Decision, Learner, StateDict, greedy_policy_of
from racecraft.algorithms.learner_wrapper import LearnerWrapper
from racecraft.algorithms.networks import is_image
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, ArraySpec, WorldSpec

AGE = "stack_age"
"""Column: how many observations of the same episode came before, k - 1 at most."""
STATE = "stack"


class StackedLearner(LearnerWrapper):
    """A learner that is fed stacks and makes them itself.

    Args:
        spec: The world's promise, of single observations.
        size: k, how many observations are seen at once; 2 or more.
        build: Makes the learner that sees the stacks.
    """

    def __init__(self, spec: WorldSpec, size: int, build: Callable[[WorldSpec], Learner]) -> None:
        super().__init__(build(replace(spec, observations=stacked_specs(spec.observations, size))))
        self.spec, self.size = spec, size
        self.frames = FrameStack(spec.observations, size)
        self._tail: dict[str, Array] = {}
        """The k - 1 observations before the next rollout, (k - 1, R, ...)."""

    @property
    def columns(self) -> Mapping[str, ArraySpec]:
        """What the inner learner notes, and AGE."""
        return {**self.inner.columns, AGE: ArraySpec((), np.int16, 0, self.size - 1, doc="observations before")}

    @property
    def policy_spec(self) -> PolicySpec:
        """The inner policy's, over single observations."""
        return replace(self.inner.policy_spec, observations=dict(self.spec.observations), stack_size=self.size)

    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Decide for R rows, exploration in; see `Actor.act`."""
        stacks, age = self.frames.push(observations, rows)
        decision = self.inner.act({**observations, **stacks}, action_mask, generator=generator, rows=rows)
        return Decision(decision.actions, {**decision.columns, AGE: age})

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        self.frames.reset_state(rows)
        self.inner.reset_state(rows)

    def choose(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return greedy actions of rows whose episode has just begun; `greedy_policy` plays on from tick to tick."""
        return self.greedy_policy().act(observations, action_mask)

    def greedy_policy(self) -> StackedPolicy:
        """Return the greedy policy, with a past of its own; it follows what is learned."""
        return StackedPolicy(self.spec.observations, self.size, greedy_policy_of(self.inner))

    def update(self, experience: Any) -> Mapping[str, float]:
        """Learn from a rollout of single observations, or from a replay, which stacks what is drawn."""
        if self.experience == REPLAY:
            return self.inner.update(experience)
        stacked, self._tail = stacked_batch(experience, self.spec.observations, self.size, self._tail)
        return self.inner.update(stacked)

    def state_dict(self) -> StateDict:
        """Return the inner learner's state, and the past of every row."""
        tail = {f"tail/{name}": torch.from_numpy(array.copy()) for name, array in self._tail.items()}
        return {**self.inner.state_dict(), STATE: {**self.frames.state(), **tail}}

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent."""
        self.inner.load_state_dict(state)
        if own := state.get(STATE):
            self.frames.restore(own)
            self._tail = {
                name.removeprefix("tail/"): part.numpy().copy() for name, part in own.items() if name[:5] == "tail/"
            }


class StackedPolicy:
    """A policy over stacks that is shown single observations.

    Args:
        observations: What is shown, by name.
        size: k.
        policy: Acts upon stacks.
    """

    def __init__(self, observations: Mapping[str, ArraySpec], size: int, policy: Any) -> None:
        self.policy, self.frames = policy, FrameStack(observations, size)

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return actions (R, ...); each row's observation becomes part of its past."""
        stacks, _ = self.frames.push(observations)
        actions: Array = self.policy.act({**observations, **stacks}, action_mask)
        return actions

    def sample(self, observations: Mapping[str, Array], action_mask: Array | None, generator: torch.Generator) -> Array:
        """Return actions (R, ...) drawn by their probability; each row's observation becomes part of its past."""
        stacks, _ = self.frames.push(observations)
        actions: Array = self.policy.sample({**observations, **stacks}, action_mask, generator)
        return actions

    def probabilities(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return how likely each of A choices is, float32 (R, A), were this seen next; nothing is remembered."""
        stacks, _ = self.frames.push(observations, keep=False)
        likely: Array = self.policy.probabilities({**observations, **stacks}, action_mask)
        return likely

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        self.frames.reset_state(rows)
        self.policy.reset_state(rows)

    @property
    def encoder(self) -> nn.Module:
        """The network from stacks to features."""
        encoder: nn.Module = self.policy.encoder
        return encoder

    def inputs(self, observations: Mapping[str, Array]) -> dict[str, Tensor]:
        """Return the stacks that the network would be fed; see `Explainable`."""
        stacks, _ = self.frames.push(observations, keep=False)
        inputs: dict[str, Tensor] = self.policy.inputs({**observations, **stacks})
        return inputs

    def scores(self, fed: Mapping[str, Tensor]) -> Scores:
        """Return what it makes of what it is fed; see `Explainable`."""
        scores: Scores = self.policy.scores(fed)
        return scores


class FrameStack:
    """The last k - 1 observations of each row, ready for the next.

    Args:
        observations: What is shown, by name; the visible ones are kept.
        size: k.
    """

    def __init__(self, observations: Mapping[str, ArraySpec], size: int) -> None:
        self.specs = {name: part for name, part in observations.items() if not part.privileged}
        self.size = size
        self.past: dict[str, Array] = {}
        """(R, k - 1, ...) by name, oldest first."""
        self.age = np.zeros(0, np.int16)
        """Observations of this episode so far, (R,), k - 1 at most."""
        self._grow(0)

    def push(
        self, observations: Mapping[str, Array], rows: Array | None = None, keep: bool = True
    ) -> tuple[dict[str, Array], Array]:
        """Return the stacks with these observations as the newest, and how many came before, int16 (R,).

        Args:
            observations: (R, ...) by name.
            rows: int64 (R,), whose they are; None: all, in order.
            keep: Whether they become part of the past.
        """
        count = len(next(observations[name] for name in self.specs))
        rows = np.arange(count) if rows is None else rows
        self._grow(int(rows.max()) + 1 if count else 0)
        age, stacks = self.age[rows].copy(), {}
        for name, part in self.specs.items():
            newest = observations[name][:, None]
            whole = np.concatenate([self.past[name][rows], newest], axis=1)
            fresh = age == 0
            whole[fresh] = newest[fresh]
            stacks[name] = joined(whole, part)
            if keep:
                self.past[name][rows] = whole[:, 1:]
        if keep:
            self.age[rows] = np.minimum(age + 1, self.size - 1)
        return stacks, age

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows (bool (R,))."""
        self._grow(len(rows))
        self.age[: len(rows)][rows] = 0

    def state(self) -> dict[str, Tensor]:
        """Return everything as named tensors (copies)."""
        return {"age": torch.from_numpy(self.age.copy())} | {
            f"past/{name}": torch.from_numpy(array.copy()) for name, array in self.past.items()
        }

    def restore(self, state: Mapping[str, Tensor]) -> None:
        """Go on from what `state` gave."""
        self.age = state["age"].numpy().copy()
        self.past = {name: state[f"past/{name}"].numpy().copy() for name in self.specs}

    def _grow(self, rows: int) -> None:
        """Have at least so many rows; new ones are at the beginning of an episode."""
        more = rows - len(self.age)
        if self.past and more <= 0:
            return
        self.age = np.concatenate([self.age, np.zeros(more, np.int16)])
        for name, part in self.specs.items():
            room = np.zeros((more, self.size - 1, *part.shape), part.dtype)
            self.past[name] = np.concatenate([self.past[name], room]) if name in self.past else room


def stacked_specs(observations: Mapping[str, ArraySpec], size: int) -> dict[str, ArraySpec]:
    """Return what is seen where k observations are laid on each other.

    >>> shapes = {"grey": (30, 40), "colour": (30, 40, 3), "speed": (2,)}
    >>> seen = {name: ArraySpec(shape, np.uint8 if len(shape) > 1 else np.float32) for name, shape in shapes.items()}
    >>> {name: part.shape for name, part in stacked_specs(seen, 4).items()}
    {'grey': (30, 40, 4), 'colour': (30, 40, 12), 'speed': (8,)}
    """
    return {name: part if part.privileged else _stacked(part, size) for name, part in observations.items()}


def joined(frames: Array, part: ArraySpec) -> Array:
    """Return k observations (R, k, *shape) as one stack (R, *stacked shape), the oldest in front."""
    rows, size = frames.shape[:2]
    if not is_image(part):
        return frames.reshape(rows, *_stacked(part, size).shape)
    channels = part.shape[2] if len(part.shape) == 3 else 1
    stack = np.empty((rows, *part.shape[:2], size, channels), frames.dtype)
    for index in range(size):  # frame by frame: a fifth of the time that turning the axes takes
        stack[..., index, :] = frames[:, index].reshape(rows, *part.shape[:2], channels)
    return stack.reshape(rows, *part.shape[:2], size * channels)


def stacked_batch(
    batch: RolloutBatch, specs: Mapping[str, ArraySpec], size: int, tail: Mapping[str, Array]
) -> tuple[RolloutBatch, dict[str, Array]]:
    """Return a rollout of single observations as one of stacks, and the tail for the next one.

    Args:
        batch: With the column `AGE`.
        specs: What it shows, of single observations.
        size: k.
        tail: The k - 1 observations before its first tick, (k - 1, R, ...) by name; empty where there are none.
    """
    ticks, rows = batch.shape
    back = np.arange(size)[::-1]
    age = batch.columns[AGE].astype(np.int64)
    ended = batch.terminated[-1] | batch.truncated[-1]
    ages = np.concatenate([age, np.where(ended, 0, np.minimum(age[-1] + 1, size - 1))[None]])
    source = np.arange(ticks + 1)[:, None, None] + size - 1 - np.minimum(back[:, None], ages[:, None, :])
    source = source * rows + np.arange(rows)  # (T + 1, k, R)

    cut_tick, cut_row = np.divmod(batch.final_index, rows)
    reach = np.minimum(age.reshape(-1)[batch.final_index] + 1, size - 1)
    before = cut_tick[:, None] + size - np.minimum(np.maximum(back, 1), reach[:, None])
    before = before * rows + cut_row[:, None]  # (F, k); the last of each is the final observation itself

    seen, last, finals, tails = {}, {}, {}, {}
    for name, array in batch.observations.items():
        part = specs.get(name)
        if part is None or part.privileged:
            continue
        first = tail.get(name)
        if first is None or first.shape[1] != rows:
            first = np.zeros((size - 1, *array.shape[1:]), array.dtype)
        line = np.concatenate([first, array, batch.last_observations[name][None]])
        tails[name] = line[ticks : ticks + size - 1].copy()
        flat = line.reshape(-1, *array.shape[2:])
        whole = np.moveaxis(flat[source], 1, 2)  # (T + 1, R, k, ...)
        stacks = joined(whole.reshape(-1, size, *array.shape[2:]), part).reshape(
            ticks + 1, rows, *_stacked(part, size).shape
        )
        seen[name], last[name] = stacks[:ticks], stacks[ticks]
        if len(batch.final_index):
            ends = flat[before]
            ends[:, -1] = batch.final_observations[name]
            finals[name] = joined(ends, part)
    columns = {name: column for name, column in batch.columns.items() if name != AGE}
    return replace(
        batch,
        observations={**batch.observations, **seen},
        last_observations={**batch.last_observations, **last},
        final_observations={**batch.final_observations, **finals},
        columns=columns,
    ), tails


def _stacked(part: ArraySpec, size: int) -> ArraySpec:
    if not is_image(part):
        return replace(part, shape=(size * int(np.prod(part.shape)),))
    height, width, *channels = part.shape
    return replace(part, shape=(height, width, size * (channels[0] if channels else 1)))


def load_stacked(spec: PolicySpec, load: Callable[[PolicySpec], Policy]) -> StackedPolicy:
    """Return the policy of a spec with a `stack_size`; `load` returns the one over stacks."""
    inner = replace(spec, observations=stacked_specs(spec.observations, spec.stack_size), stack_size=1)
    return StackedPolicy(spec.observations, spec.stack_size, load(inner))
