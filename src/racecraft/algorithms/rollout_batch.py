"""What was collected, as a learner reads it."""

from __future__ import annotations

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
