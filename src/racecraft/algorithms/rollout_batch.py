"""What was collected, as a learner reads it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from racecraft.contract.world import Array


@dataclass
class RolloutBatch:
    """T ticks of R rows (worlds times agents). Every array begins with (T, R) unless it says otherwise."""

    observations: dict[str, Array]
    """What was seen before acting, by name, in the world's own types."""
    actions: Array
    """What the world was told, in the type of its action spec."""
    reward: Array
    """float32: of the tick that the action began."""
    terminated: Array
    """bool: the story ended in that tick."""
    truncated: Array
    """bool: we stopped watching in that tick."""
    active: Array
    """bool: the row is to be learned from."""
    last_observations: dict[str, Array]
    """(R, ...): what is seen after the last tick."""
    last_active: Array
    """bool (R,): the action after the last tick will be obeyed."""
    columns: dict[str, Array] = field(default_factory=dict)
    """What the learner itself noted when it decided: its `columns`."""
    action_mask: Array | None = None
    """bool (T, R, A), True where a choice was allowed; None where the world has no mask."""
    last_action_mask: Array | None = None
    """bool (R, A): likewise, after the last tick."""
    final_index: Array = field(default_factory=lambda: np.zeros(0, np.int64))
    """int64 (F,): t * R + r of each tick that was truncated and not terminated; rising."""
    final_observations: dict[str, Array] = field(default_factory=dict)
    """(F, ...): the last observation of those episodes, from which value still follows."""

    @property
    def shape(self) -> tuple[int, int]:
        """(T, R)."""
        ticks, rows = self.reward.shape
        return ticks, rows

    @property
    def num_active(self) -> int:
        """How many transitions there are to learn from."""
        return int(self.active.sum())

    @property
    def final_places(self) -> tuple[Array, Array]:
        """Tick and row of each of `final_index`, int64 (F,) both: places in any (T, R), however it lies in memory."""
        ticks, rows = np.divmod(self.final_index, self.reward.shape[1])
        return ticks, rows

    def of_rows(self, rows: Array) -> RolloutBatch:
        """Return the chosen rows (int64 (r,), rising) of every array; columns and observations keep their names."""
        width = self.reward.shape[1]
        places = np.full(width, -1, np.int64)
        places[rows] = np.arange(len(rows))
        ticks, owners = np.divmod(self.final_index, width)
        mine = places[owners] >= 0
        return replace(
            self,
            observations={name: array[:, rows] for name, array in self.observations.items()},
            actions=self.actions[:, rows],
            reward=self.reward[:, rows],
            terminated=self.terminated[:, rows],
            truncated=self.truncated[:, rows],
            active=self.active[:, rows],
            last_observations={name: array[rows] for name, array in self.last_observations.items()},
            last_active=self.last_active[rows],
            columns={name: array[:, rows] for name, array in self.columns.items()},
            action_mask=None if self.action_mask is None else self.action_mask[:, rows],
            last_action_mask=None if self.last_action_mask is None else self.last_action_mask[rows],
            final_index=ticks[mine] * len(rows) + places[owners[mine]],
            final_observations={name: array[mine] for name, array in self.final_observations.items()},
        )


def concat_rows(batches: Sequence[RolloutBatch]) -> RolloutBatch:
    """Return the rows of several batches as those of one, in their order (copies): the reverse of `of_rows`.

    Where some have fewer ticks than others, their rows stand still at the end and are not learned from there.
    """
    first, ticks = batches[0], max(batch.shape[0] for batch in batches)
    width = sum(batch.shape[1] for batch in batches)

    def rows(arrays: Sequence[Array]) -> Array:
        joined = np.zeros((ticks, width, *arrays[0].shape[2:]), arrays[0].dtype)
        at = 0
        for array in arrays:
            joined[: len(array), at : at + array.shape[1]] = array
            at += array.shape[1]
        return joined

    def masks(arrays: Sequence[Array | None]) -> Array | None:
        known = [array for array in arrays if array is not None]
        if not known:
            return None
        joined = rows(known)
        at = 0
        for array in known:
            joined[len(array) :, at : at + array.shape[1]] = True  # a row that stands still may do anything
            at += array.shape[1]
        return joined

    lasts = [batch.last_action_mask for batch in batches if batch.last_action_mask is not None]
    order, final_index, finals = _finals_side_by_side(batches, width)
    return RolloutBatch(
        observations={name: rows([batch.observations[name] for batch in batches]) for name in first.observations},
        actions=rows([batch.actions for batch in batches]),
        reward=rows([batch.reward for batch in batches]),
        terminated=rows([batch.terminated for batch in batches]),
        truncated=rows([batch.truncated for batch in batches]),
        active=rows([batch.active for batch in batches]),
        last_observations={
            name: np.concatenate([batch.last_observations[name] for batch in batches])
            for name in first.last_observations
        },
        last_active=np.concatenate([batch.last_active for batch in batches]),
        columns={name: rows([batch.columns[name] for batch in batches]) for name in first.columns},
        action_mask=masks([batch.action_mask for batch in batches]),
        last_action_mask=np.concatenate(lasts) if lasts else None,
        final_index=final_index,
        final_observations={
            name: np.concatenate([batch.final_observations[name] for batch in finals])[order]
            for name in (finals[0].final_observations if finals else ())
        },
    )


def _finals_side_by_side(batches: Sequence[RolloutBatch], width: int) -> tuple[Array, Array, list[RolloutBatch]]:
    """Return in which order the final observations of all batches stand, their places, and which batches have any."""
    places, having, at = [np.zeros(0, np.int64)], [], 0
    for batch in batches:
        ticks, owners = np.divmod(batch.final_index, batch.shape[1])
        places.append(ticks * width + at + owners)
        having += [batch] if len(batch.final_index) else []
        at += batch.shape[1]
    every = np.concatenate(places)
    order = np.argsort(every, kind="stable")
    return order, every[order], having
