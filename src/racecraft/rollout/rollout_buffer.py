"""Storage of a rollout. The worlds write into it in place: one `StepBuffers` of views for every tick.

Row t holds what was seen before tick t, what was decided, and what the tick brought. There is one row more of what
worlds show *after* a tick (observations, `active`, masks) than of what a tick brings; the last of them opens the next
rollout. Frames stay in the type the world gives them, uint8 for cameras. Final observations are not kept: one place per
car is enough, for their values are taken at once.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from racecraft.algorithms.rollout_batch import Experience
from racecraft.contract.world import Array, ContinuousActions, StepBuffers, WorldSpec, allocate


class RolloutBuffer:
    """T ticks of N worlds of M agents.

    Args:
        spec: The world's promise.
        ticks: T; `grow` makes room for more.

    `views[t]`, for t from 0 to T, is where the world writes what begins row t.
    """

    def __init__(self, spec: WorldSpec, ticks: int) -> None:
        self.spec = spec
        self.scratch = allocate(spec)
        self._shape = (spec.num_worlds, spec.num_agents)
        self._make(ticks)

    def _make(self, ticks: int) -> None:
        spec, rows = self.spec, self._shape
        self.ticks = ticks
        actions = spec.actions
        width = (len(actions.low),) if isinstance(actions, ContinuousActions) else ()
        kept, seen = (ticks, *rows), (ticks + 1, *rows)
        self.observations = {name: np.zeros(seen + part.shape, part.dtype) for name, part in spec.observations.items()}
        self.active = np.ones(seen, bool)
        self.action_mask = None
        if self.scratch.action_mask is not None:
            self.action_mask = np.ones((ticks + 1, *self.scratch.action_mask.shape), bool)
        self.samples = np.zeros(kept + width, np.float32 if width else np.int64)
        self.log_prob, self.value, self.reward, self.final_value = (np.zeros(kept, np.float32) for _ in range(4))
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

    def carry_over(self, t: int) -> None:
        """Let row t open the next rollout: copy what the worlds show there to row 0."""
        if t:
            copy_shown(self.views[t], self.views[0])

    def grow(self, ticks: int) -> None:
        """Make room for `ticks` rows and keep what stands in the present ones."""
        before, old = self.ticks, dict(vars(self))
        self._make(ticks)
        for name, array in old["observations"].items():
            self.observations[name][: before + 1] = array
        for name in ("active", "action_mask"):
            if old[name] is not None:
                getattr(self, name)[: before + 1] = old[name]
        for name in ("samples", "log_prob", "value", "reward", "final_value", "terminated", "truncated", "learn"):
            getattr(self, name)[:before] = old[name]

    def experience(self, ticks: int, last_value: Array) -> Experience:
        """Return the first `ticks` rows for a learner, worlds and agents as R = N * M rows. Views, no copies.

        Args:
            ticks: How many rows were filled.
            last_value: float32 (R,), of what is shown after the last of them.
        """

        def rows(array: Array) -> Array:
            return array[:ticks].reshape(ticks, -1, *array.shape[3:])

        return Experience(
            observations={name: rows(array) for name, array in self.observations.items()},
            samples=rows(self.samples),
            log_prob=rows(self.log_prob),
            value=rows(self.value),
            reward=rows(self.reward),
            terminated=rows(self.terminated),
            truncated=rows(self.truncated),
            active=rows(self.active) & rows(self.learn),
            final_value=rows(self.final_value),
            last_value=last_value,
            action_mask=None if self.action_mask is None else rows(self.action_mask),
        )


def copy_shown(source: StepBuffers, target: StepBuffers) -> None:
    """Copy what a world shows for the coming tick: observations, `active` and the mask."""
    for name, array in source.observations.items():
        np.copyto(target.observations[name], array)
    np.copyto(target.active, source.active)
    if source.action_mask is not None and target.action_mask is not None:
        np.copyto(target.action_mask, source.action_mask)
