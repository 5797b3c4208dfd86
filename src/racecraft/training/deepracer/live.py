"""An observer that leaves the latest ticks in the run folder while somebody watches. See `LivePublisher`."""

from __future__ import annotations

import time

import numpy as np

from racecraft.contract.world import Array, StepBuffers, World
from racecraft.envs.deepracer import race
from racecraft.envs.deepracer.side_by_side import SideBySide
from racecraft.envs.deepracer.world import RaceWorld
from racecraft.formats.episodes import STATUSES
from racecraft.formats.live_ticks import forget_live_ticks, is_watched, write_live_ticks
from racecraft.formats.run_folder import RunFolder
from racecraft.training.deepracer.against import AgainstWorld

RING_TICKS = 64
"""Ticks that are left at a time: 4.3 simulated seconds."""
EVERY_SECONDS = 1.0
"""How often it is looked whether somebody watches, and how often the ticks are left then, be they ever so few."""
LEAST_SECONDS = 0.2
"""So soon they are left again where as many came as are left at a time: worlds stand still while is learned."""
IN_FILES = np.array([STATUSES.index(word) for word in race.STATUSES], np.uint8)
"""Code of each of the race's statuses among those of episode files."""


class LivePublisher:
    """Leaves the latest ticks of every car; of several courses, of those on the first.

    Where nobody watches it costs a look at the clock a tick.

    Args:
        run: The run folder; what an earlier training of it left is taken away.
    """

    def __init__(self, run: RunFolder) -> None:
        self._run = run
        self._ring: Array | None = None
        self._rewards: Array | None = None
        self._record = race.TICK_REPORT
        self._ticks = self._kept = self._fresh = 0
        """Ticks taken; the latest of them that the ring holds; of these, those that were not left yet."""
        self._looked = 0.0
        self._watched = False
        forget_live_ticks(run)

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        """Keep one tick, if somebody watches, and leave the latest when it is time."""
        assert isinstance(world, RaceWorld | SideBySide | AgainstWorld)
        self._ticks += 1
        if self._watched:
            shown = world.courses[0] if isinstance(world, SideBySide) else world  # a page draws one circuit
            self._keep(shown.reports, buffers.reward[: shown.spec.num_worlds])
        past = time.monotonic() - self._looked
        if past < EVERY_SECONDS and (self._fresh < RING_TICKS or past < LEAST_SECONDS):
            return
        self._looked += past
        if self._fresh:
            write_live_ticks(self._run, self._ticks, self._columns())
        self._watched = is_watched(self._run)
        self._fresh = 0
        if not self._watched:
            self._kept = 0

    def _keep(self, reports: Array, rewards: Array) -> None:
        """Keep one tick, as bytes: records are copied field by field, which takes ten times as long."""
        if self._ring is None or self._rewards is None:
            self._ring = np.zeros((RING_TICKS, reports.nbytes), np.uint8)
            self._rewards = np.zeros((RING_TICKS, reports.size), np.float32)
            self._record = reports.dtype
        place = self._ticks % RING_TICKS
        self._ring[place] = reports.reshape(-1).view(np.uint8)
        self._rewards[place] = rewards.reshape(-1)
        self._kept, self._fresh = min(self._kept + 1, RING_TICKS), self._fresh + 1

    def _columns(self) -> dict[str, Array]:
        """Return what the ring holds, oldest first, in the words of episode files."""
        assert self._ring is not None
        assert self._rewards is not None
        order = (self._ticks + 1 - self._kept + np.arange(self._kept)) % RING_TICKS
        ticks = self._ring[order].view(self._record)
        return {
            "x_m": ticks["front_x"].astype(np.float32),
            "y_m": ticks["front_y"].astype(np.float32),
            "yaw_rad": ticks["yaw"].astype(np.float32),
            "velocity_mps": ticks["driven_speed"].astype(np.float32),
            "speed_mps": ticks["speed"].astype(np.float32),
            "steering_rad": ticks["steering"].astype(np.float32),
            "progress_share": (ticks["progress"] / 100.0).astype(np.float32),
            "reward": self._rewards[order],
            "episode": ticks["episode"].astype(np.int32),
            "tick": ticks["steps"].astype(np.int32),
            "done": ticks["terminated"] | ticks["truncated"],
            "status": IN_FILES[ticks["status"]],
        }
