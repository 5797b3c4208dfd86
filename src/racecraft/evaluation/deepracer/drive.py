"""Watch one car drive: every tick's report, for pictures, videos and tables."""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import Array, StepBuffers, World
from racecraft.envs.deepracer.world import RaceWorld


class DriveKeeper:
    """An observer that keeps what was written down of one car, tick by tick."""

    def __init__(self, world: int = 0, car: int = 0) -> None:
        self._place = world, car
        self._reports: list[Array] = []

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        """Keep one tick."""
        assert isinstance(world, RaceWorld)
        self._reports.append(world.reports[self._place].copy())

    @property
    def drive(self) -> Array:
        """The ticks kept so far, TICK_REPORT (T,)."""
        return np.array(self._reports, dtype=self._reports[0].dtype) if self._reports else np.empty(0)
