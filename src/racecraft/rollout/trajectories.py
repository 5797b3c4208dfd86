"""Storage of a rollout. The worlds write into it in place: one `StepBuffers` of views for every tick.

Row t holds what was seen before tick t, what was decided, and what the tick brought. There is one row more of what
worlds show *after* a tick (observations, `active`, masks) than of what a tick brings; the last of them opens the next
rollout. Frames stay in the type the world gives them, uint8 for cameras. Final observations are sparse: only those of
episodes that were cut are kept, each once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.world import Array, ArraySpec, StepBuffers, WorldSpec, allocate


class Trajectories:
    """T ticks of N worlds of M agents.

    Args:
        spec: The world's promise.
        ticks: T; `grow` makes room for more.
        columns: What the learner notes of each decision.

    `views[t]`, for t from 0 to T, is where the world writes what begins row t.
    """

    def __init__(self, spec: WorldSpec, ticks: int, columns: Mapping[str, ArraySpec]) -> None:
        self.spec, self._columns = spec, dict(columns)
        self.scratch = allocate(spec)
        self._shape = (spec.num_worlds, spec.num_agents)
        self._finals: list[tuple[int, Array, dict[str, Array]]] = []
        self._make(ticks)

    def _make(self, ticks: int) -> None:
        spec, rows = self.spec, self._shape
        self.ticks = ticks
        kept, seen = (ticks, *rows), (ticks + 1, *rows)
        self.observations = {name: np.zeros(seen + part.shape, part.dtype) for name, part in spec.observations.items()}
        self.active = np.ones(seen, bool)
        self.action_mask = None
        if self.scratch.action_mask is not None:
            self.action_mask = np.ones((ticks + 1, *self.scratch.action_mask.shape), bool)
        self.actions = np.zeros(kept + spec.actions.shape, spec.actions.dtype)
        self.columns = {name: np.zeros(kept + part.shape, part.dtype) for name, part in self._columns.items()}
        self.reward = np.zeros(kept, np.float32)
        self.terminated, self.truncated = np.zeros(kept, bool), np.zeros(kept, bool)
        self.learn = np.ones(kept, bool)
        """bool (T, N, M): False keeps a row out of learning although the world obeyed it (a quota that is full)."""
        self.views = [self._view(t) for t in range(ticks + 1)]

    def _view(self, t: int) -> StepBuffers:
        before = max(t - 1, 0)  # row 0 is begun by a reset, which writes none of the three
        return replace(
            self.scratch,
            observations={name: array[t] for name, array in self.observations.items()},
            reward=self.reward[before],
            terminated=self.terminated[before],
            truncated=self.truncated[before],
            active=self.active[t],
            action_mask=None if self.action_mask is None else self.action_mask[t],
        )

    def begin(self) -> None:
        """Forget the final observations of the rollout before."""
        self._finals.clear()

    def carry_over(self, t: int) -> None:
        """Let row t open the next rollout: copy what the worlds show there to row 0."""
        if t:
            copy_observations(self.views[t], self.views[0])

    def store_final_observations(self, t: int, then: StepBuffers) -> None:
        """Keep the last observations of episodes that tick t cut short; value still follows from them."""
        cut = (then.truncated & ~then.terminated).reshape(-1)
        if cut.any():
            rows = np.flatnonzero(cut)
            final = {name: array.reshape(-1, *array.shape[2:])[rows] for name, array in then.final_observations.items()}
            self._finals.append((t, rows, final))

    def grow(self, ticks: int) -> None:
        """Make room for `ticks` rows and keep what stands in the present ones."""
        before, old = self.ticks, dict(vars(self))
        self._make(ticks)
        for name in ("observations", "columns"):
            last = before + 1 if name == "observations" else before
            for part, array in old[name].items():
                getattr(self, name)[part][:last] = array
        for name in ("active", "action_mask"):
            if old[name] is not None:
                getattr(self, name)[: before + 1] = old[name]
        for name in ("actions", "reward", "terminated", "truncated", "learn"):
            getattr(self, name)[:before] = old[name]

    def batch(self, ticks: int) -> RolloutBatch:
        """Return the first `ticks` rows for a learner, worlds and agents as R = N * M rows. Views, no copies."""

        def rows(array: Array) -> Array:
            return array[:ticks].reshape(ticks, -1, *array.shape[3:])

        def last(array: Array) -> Array:
            return array[ticks].reshape(-1, *array.shape[3:])

        width = self._shape[0] * self._shape[1]
        return RolloutBatch(
            observations={name: rows(array) for name, array in self.observations.items()},
            actions=rows(self.actions),
            reward=rows(self.reward),
            terminated=rows(self.terminated),
            truncated=rows(self.truncated),
            active=rows(self.active) & rows(self.learn),
            last_observations={name: last(array) for name, array in self.observations.items()},
            last_active=last(self.active),
            columns={name: rows(array) for name, array in self.columns.items()},
            action_mask=None if self.action_mask is None else rows(self.action_mask),
            last_action_mask=None if self.action_mask is None else last(self.action_mask),
            final_index=np.concatenate([t * width + at for t, at, _ in self._finals] or [np.zeros(0, np.int64)]),
            final_observations={
                name: np.concatenate([final[name] for _, _, final in self._finals]) for name in self.observations
            }
            if self._finals
            else {},
        )


def copy_observations(source: StepBuffers, target: StepBuffers) -> None:
    """Copy what a world shows for the coming tick: observations, `active` and the mask."""
    for name, array in source.observations.items():
        np.copyto(target.observations[name], array)
    np.copyto(target.active, source.active)
    if source.action_mask is not None and target.action_mask is not None:
        np.copyto(target.action_mask, source.action_mask)
