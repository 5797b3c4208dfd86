"""The learner's own seats in worlds of several agents, as rows of one agent each. See `LearnerRows`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from racecraft.contract.world import Array, EpisodeRecord, StepBuffers


class LearnerRows:
    """Which seats are the learner's; rows are counted world by world, in each by the number of the agent.

    Args:
        mine: bool (N, M), True where the learner sits.
    """

    def __init__(self, mine: Array) -> None:
        self.mine = mine
        self._row_of = np.cumsum(mine.reshape(-1)).reshape(mine.shape) - 1

    def __len__(self) -> int:
        return int(self.mine.sum())

    def show(self, whole: StepBuffers, own: StepBuffers) -> None:
        """Copy what is seen, allowed and learned from."""
        for name, array in whole.observations.items():
            own.observations[name][:, 0] = array[self.mine]
        own.active[:, 0] = whole.active[self.mine]
        if own.action_mask is not None and whole.action_mask is not None:
            own.action_mask[:, 0] = whole.action_mask[self.mine]

    def hand_on(self, whole: StepBuffers, own: StepBuffers) -> None:
        """Copy what a step came to, for the learner's seats (N, M) into rows (R, 1)."""
        for name in ("reward", "terminated", "truncated"):
            getattr(own, name)[:, 0] = getattr(whole, name)[self.mine]
        ended = own.ended[:, 0]
        if ended.any():
            for name, array in whole.final_observations.items():
                own.final_observations[name][ended, 0] = array[self.mine][ended]

    def episodes(self, records: Iterable[EpisodeRecord]) -> list[EpisodeRecord]:
        """Return the learner's episodes; the agent is always 0, the world the row."""
        own = (one for one in records if self.mine[one.world, one.agent])
        return [replace(one, world=int(self._row_of[one.world, one.agent]), agent=0) for one in own]
