"""An observer that leaves ticks in the run folder when somebody wishes for them. See `LivePublisher`."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from racecraft.contract.world import Array, StepBuffers, World
from racecraft.formats.episodes import STATUSES
from racecraft.formats.live_ticks import OBJECTS, forget_live_ticks, latest_request, write_live_ticks
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.alternating import AlternatingWorld
from racecraft.worlds.deepracer.env.multi_course import MultiCourseWorld
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.training.opponent_world import OpponentWorld

RING_TICKS = 64
"""Ticks that are left for a wish: 4.3 simulated seconds."""
LOOK_SECONDS = 0.25
"""How often it is looked whether somebody wishes for ticks."""
PART_SECONDS = 1.0
"""So long after a wish what there is is left, be it ever so little: a training may drive slower than is watched."""
IN_FILES = np.array([STATUSES.index(word) for word in race.STATUSES], np.uint8)
"""Code of each of the race's statuses among those of episode files."""


class LivePublisher:
    """Leaves the next ticks of every car for each wish, course by course, and where boxes and bots then stood.

    A wish is answered by the next RING_TICKS ticks, left at once when they have all come; while none is open, a tick
    costs a look at the clock. A training too slow for that leaves what it has every PART_SECONDS, and whoever wishes on
    meanwhile gets every tick without a gap.

    Args:
        run: The run folder; what an earlier training of it left is taken away.
    """

    def __init__(self, run: RunFolder) -> None:
        self._run = run
        self._ring: Array | None = None
        self._rewards: Array | None = None
        self._objects: dict[int, Array] = {}
        """Of each course that has any, by its number, (RING_TICKS, N, K, 3): x, y, yaw."""
        self._first_worlds: Array = np.zeros(0, int)
        self._ticks = self._kept = self._due = 0
        """Ticks taken; the latest of them that the ring holds; those that the open wish still has to come."""
        self._answered: int | None = None
        """The latest wish that what is left answers."""
        self._looked = 0.0
        """When it was last looked for a wish, or left what there was."""
        forget_live_ticks(run)

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        """Keep one tick, if somebody wished for it, and leave those kept when it is time."""
        assert isinstance(world, RaceWorld | MultiCourseWorld | OpponentWorld)
        self._ticks += 1
        if not self._due:
            self._look_for_a_wish()
            return
        self._keep(world.courses if isinstance(world, MultiCourseWorld) else (world,), buffers.reward)
        self._due -= 1
        if not self._due or time.monotonic() - self._looked >= PART_SECONDS:
            self._leave()

    def _look_for_a_wish(self) -> None:
        """Have the next RING_TICKS ticks kept, if it is time to look and there is a wish that was not answered."""
        now = time.monotonic()
        if now - self._looked < LOOK_SECONDS:
            return
        self._looked = now
        wish = latest_request(self._run)
        if wish is not None and wish != self._answered:
            self._answered, self._kept, self._due = wish, 0, RING_TICKS

    def _leave(self) -> None:
        """Leave the ticks kept, which answers every wish until now; who wished behind a part wants what follows."""
        wish = latest_request(self._run)
        if self._due and wish not in (None, self._answered):
            self._due = RING_TICKS
        write_live_ticks(self._run, self._ticks, self._columns())
        self._answered, self._looked = wish, time.monotonic()

    def _keep(self, courses: Sequence[RaceWorld | AlternatingWorld | OpponentWorld], rewards: Array) -> None:
        """Keep one tick, as bytes: records are copied field by field, which takes ten times as long."""
        if self._ring is None or self._rewards is None:
            self._ring, self._rewards = self._make_buffers(courses, rewards.size)
        place, first = self._ticks % RING_TICKS, 0
        for course in courses:
            behind = first + course.reports.nbytes
            self._ring[place, first:behind] = course.reports.reshape(-1).view(np.uint8)
            first = behind
        for number, kept in self._objects.items():
            kept[place] = courses[number].seen_boxes[..., :3]
        self._rewards[place] = rewards.reshape(-1)
        self._kept = min(self._kept + 1, RING_TICKS)

    def _make_buffers(
        self, courses: Sequence[RaceWorld | AlternatingWorld | OpponentWorld], cars: int
    ) -> tuple[Array, Array]:
        """Return room for the reports and the rewards of RING_TICKS ticks, and make some for what is in the way."""
        worlds = [course.spec.num_worlds for course in courses]
        self._first_worlds = np.cumsum([0, *worlds[:-1]])
        self._objects = {
            number: np.zeros((RING_TICKS, *course.seen_boxes.shape[:2], 3), np.float32)
            for number, course in enumerate(courses)
            if course.seen_boxes.size
        }
        reports = np.zeros((RING_TICKS, sum(course.reports.nbytes for course in courses)), np.uint8)
        return reports, np.zeros((RING_TICKS, cars), np.float32)

    def _columns(self) -> dict[str, Array]:
        """Return what the ring holds, oldest first, in the words of episode files."""
        assert self._ring is not None
        assert self._rewards is not None
        order = (self._ticks + 1 - self._kept + np.arange(self._kept)) % RING_TICKS
        ticks = self._ring[order].view(race.TICK_REPORT)
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
            **{f"{OBJECTS}{self._first_worlds[number]}": kept[order] for number, kept in self._objects.items()},
        }
