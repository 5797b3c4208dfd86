"""Watch one car drive: every tick's report and what stood in its way, for pictures, videos and tables."""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import Array, StepBuffers, World
from racecraft.worlds.deepracer.env.world import RaceWorld


class DriveKeeper:
    """An observer that keeps what was written down of one car, tick by tick."""

    def __init__(self, world: int = 0, car: int = 0) -> None:
        self._place = world, car
        self._reports: list[Array] = []
        self._boxes: list[Array] = []
        self._kinds = np.zeros(0, np.int64)

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        """Keep one tick."""
        assert isinstance(world, RaceWorld)
        self._reports.append(world.reports[self._place].copy())
        self._boxes.append(world.seen_boxes[self._place[0]].copy())
        self._kinds = world.kinds[self._place[0]]

    @property
    def drive(self) -> Array:
        """The ticks kept so far, TICK_REPORT (T,)."""
        return np.array(self._reports, dtype=self._reports[0].dtype) if self._reports else np.empty(0)

    @property
    def objects(self) -> tuple[Array, Array] | None:
        """Boxes and bots in those ticks, (T, K, 6) and their kinds (T, K), as `Objects` has them; None without any."""
        if not self._kinds.size:
            return None
        boxes = np.array(self._boxes)
        return boxes, np.tile(self._kinds, (len(boxes), 1))
