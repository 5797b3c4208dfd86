"""Why a policy fails: drive it from many starts, group its failures by place, and try what would have saved them.

Begin with `explain_failures`.
"""

from __future__ import annotations

import contextlib
import io
import time
from collections import Counter
from collections.abc import Iterator
from functools import cached_property

import numpy as np

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.recurrent_network import NONE
from racecraft.contract.errors import RewardError, RewardFileError
from racecraft.contract.world import Array, allocate
from racecraft.worlds.deepracer.analysis import tables
from racecraft.worlds.deepracer.analysis.drive import OFF_TRACK
from racecraft.worlds.deepracer.analysis.failure_places import Alternative, Before, FailurePlace, RewardLine, Why
from racecraft.worlds.deepracer.analysis.logs.segments import Segments, find_segments
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.camera import Camera
from racecraft.worlds.deepracer.env.reward_process import RewardCopies, open_reward
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.counterfactuals import (
    HOLDS,
    MOMENTS,
    Options,
    Trials,
    command_words,
    try_alternatives,
)
from racecraft.worlds.deepracer.evaluation.failure_clusters import cluster_failures
from racecraft.worlds.deepracer.evaluation.recorded_drives import RecordedDrives, record_drives
from racecraft.worlds.deepracer.evaluation.rerun import states_of
from racecraft.worlds.deepracer.files.reward_trace import Term, line_of
from racecraft.worlds.deepracer.players.trained_car import TrainedCar
from racecraft.worlds.deepracer.tracks.track import Track

STARTS = 24
"""Round the lap, evenly."""
PLACES, FAILURES = 3, 8
"""Places that are explained, and failures of each for which cures are tried, evenly taken of all."""
SECONDS = 90.0
"""About so long the cures of all places may take."""
TIMED_CARS, TIMED_TICKS, USUAL_TICKS = 32, 4, 40
"""What is timed beforehand, and how long a change is usually driven."""
CURES = 3
"""Cures that are told of a place, each another action."""
SHOWN_TICKS = 16
"""Of the last second, the tick that ends it included."""
LOG_TICKS = 500_000
"""Of a longer log the latest ticks tell where cars left the road in training."""
LATE = 0.4
"""The last two fifths of the iterations are late."""
BESIDE_M = 0.5
"""An exit in training so near to a place is there."""
FRAME = (160, 120)
"""Pixels of the pictures for people."""


def explain_failures(
    car: TrainedCar,
    track: Track,
    name: str,
    starts: int = STARTS,
    places: int = PLACES,
    failures: int = FAILURES,
    seconds: float = SECONDS,
) -> Why:
    """Drive a car from many starts and explain where and why it fails.

    Args:
        car: Who drives.
        track: Where.
        name: What a command calls the run.
        starts: How many, evenly round the lap.
        places: So many places at most are explained, those with most failures.
        failures: Of each so many failures at most are tried to be cured.
        seconds: About so long that may take; a large network on a slow machine gets fewer failures, never none.

    Raises:
        EpisodeFileError: A file of the run's log is damaged.
    """
    began = time.perf_counter()
    explaining = _Explaining(car, track, starts)
    drives, failed = explaining.drives, explaining.drives.failed
    arcs = drives.endings["arc"][failed]
    groups = [failed[group] for group in cluster_failures(arcs, explaining.track.length, explaining.track.closed)]
    if groups:
        explaining.limit(failures, seconds / min(places, len(groups)))
    explained = [explaining.place(number, rows) for number, rows in enumerate(groups[:places], 1)]
    statuses = drives.endings["status"]
    return Why(
        run=name,
        checkpoint=car.checkpoint.iteration,
        track=explaining.track,
        starts=starts,
        full=int((statuses == race.LAP_COMPLETE).sum()),
        out_of_time=int((drives.endings["truncated"] | (statuses == race.TIME_UP)).sum()),
        places=explained,
        changes=explaining.changes,
        seconds=time.perf_counter() - began,
        not_explained=sum(len(rows) for rows in groups[places:]),
        reward_note=explaining.reward_note,
        paths=[_path(drives, row) for row in failed],
    )


def remembers(spec: PolicySpec) -> bool:
    """Tell whether a policy's decision depends on more than what it sees at the moment."""
    return spec.stack_size > 1 or spec.network.get("memory", NONE) != NONE


class _Explaining:
    """One car's drives, and what is found out about them."""

    def __init__(self, car: TrainedCar, track: Track, starts: int) -> None:
        self.car, self._track, self._failures = car, track, FAILURES
        shares = (np.arange(starts) / starts).tolist()
        world = car.world(track, starts, shares)
        self.track, self.scene = world.track, world.camera.scene
        self.drives = record_drives(car.policy, world)
        self.segments: Segments = find_segments(self.track)
        self.changes, self.reward_note = 0, ""

    def limit(self, failures: int, seconds: float) -> None:
        """Try as many failures of a place as so many seconds allow, by a few ticks that are timed; at least one."""
        world = self.worlds(TIMED_CARS)
        buffers = allocate(world.spec)
        world.reset(buffers, 0)
        for tick in range(2 * TIMED_TICKS):
            if tick == TIMED_TICKS:  # the first ones load what is compiled
                began = time.perf_counter()
            seen = {name: part[:, 0] for name, part in buffers.observations.items()}
            world.step(np.asarray(self.car.policy.act(seen, None))[:, None], buffers)
        self.car.policy.reset_state(np.ones(TIMED_CARS, bool))
        each = (time.perf_counter() - began) / (TIMED_TICKS * TIMED_CARS)
        one = len(MOMENTS) * len(Options.of(self.car.actions).labels) * len(HOLDS) * USUAL_TICKS * each
        self._failures = int(np.clip(seconds / one, 1, failures))

    def worlds(self, count: int) -> RaceWorld:
        """Return so many cars of this kind."""
        return self.car.world(self._track, count, [0.0] * count)

    def place(self, number: int, rows: Array) -> FailurePlace:
        """Explain the failures of some rows, which lie at one place in driving order."""
        ends = self.drives.endings[rows]
        middle = ends[len(ends) // 2]
        some = rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), self._failures)).round().astype(int))]
        trials = self._trials(some)
        names = [race.STATUSES[status] for status in ends["status"]]
        segment = self.segments.all[int(self.segments.of(np.array([middle["arc"] / self.track.length]))[0])]
        return FailurePlace(
            number=number,
            segment=segment.name,
            arc_m=float(middle["arc"]),
            waypoints=(int(ends["waypoint_nearest"][0]), int(ends["waypoint_nearest"][-1])),
            failures=len(rows),
            reached=self._reached(float(ends["arc"][0]), rows),
            how=dict(Counter(names).most_common()),
            speed_mps=float(ends["driven_speed"].mean()),
            xy=np.column_stack([ends["front_x"], ends["front_y"]]),
            before=self._before(int(rows[len(rows) // 2])),
            cures=self._cures(trials),
            moments=trials.moments / TICKS_PER_SECOND,
            saveable=trials.best_share,
            held_seconds=trials.holds / TICKS_PER_SECOND,
            in_training=self._in_training(float(ends["arc"][0]), float(ends["arc"][-1])),
        )

    def _trials(self, rows: Array) -> Trials:
        car = self.car
        trials = try_alternatives(car.policy, self.worlds, self.drives, rows, car.actions, remembers(car.policy.spec))
        self.changes += trials.saved.size
        return trials

    def _reached(self, arc: float, failed: Array) -> int:
        """Return how many cars came as far as a place; those that failed there did, wherever in it."""
        lap, endings = self.track.length, self.drives.endings
        ahead = (arc / lap - endings["start_share"]) % 1.0 if self.track.closed else arc / lap - endings["start_share"]
        came = endings["progress"] / 100.0 >= ahead
        came[failed] = True
        return int(came.sum())

    @cached_property
    def _late_exits(self) -> Array | None:
        """Where cars left the road in the last two fifths of the training, m along the centre line."""
        if self._track is not self.car.trained_on:
            return None
        ticks = tables.load_episodes(self.car.run, LOG_TICKS)
        if not ticks.height or "iteration" not in ticks.columns:
            return None
        laps = tables.laps_table(ticks)
        first, last = (float(value or 0) for value in (laps["iteration"].min(), laps["iteration"].max()))  # type: ignore[arg-type]
        late = laps.filter((laps["status"] == OFF_TRACK) & (laps["iteration"] > last - LATE * (last - first)))
        return np.asarray(self.track.locate(late.select("x_m", "y_m").to_numpy()).arc)

    def _in_training(self, first: float, last: float) -> int | None:
        """Return how many of them lie at a place, or half a metre before or behind it."""
        if self._late_exits is None:
            return None
        lap = self.track.length
        along = (self._late_exits - first + BESIDE_M) % lap
        return int((along <= (last - first) % lap + 2.0 * BESIDE_M).sum())

    def _cures(self, trials: Trials) -> list[Alternative]:
        """Return the best changes, each of another action."""
        drives, rows = self.drives, trials.rows
        at = drives.last[rows][:, None] - trials.moments  # (F, D)
        reports = drives.reports[np.maximum(at, 0), rows[:, None]]
        common = [_commonest(reports[:, d]) for d in range(len(trials.moments))]
        ranked = trials.ranked(np.array([command for command, _ in common]))
        cures: list[Alternative] = []
        for d, a, h in ranked:
            saved, label = int(trials.counts[d, a, h]), trials.options.labels[a]
            if not saved or len(cures) == CURES:
                break
            if any(cure.action == label for cure in cures):
                continue
            command, waypoint = common[d]
            before, held = trials.moments[d] / TICKS_PER_SECOND, trials.holds[h] / TICKS_PER_SECOND
            was = command_words(*command)
            cures.append(Alternative(float(before), waypoint, label, was, float(held), saved, len(rows)))
        return cures

    def _before(self, row: int) -> Before:
        """Return the last second of a row's episode."""
        whole, last = self.drives.of(row), int(self.drives.last[row])
        first = max(1, last + 1 - SHOWN_TICKS)
        reports, ticks = whole[first:], np.arange(first, last + 1)
        rewards, lines = self._paid(row, first)
        return Before(
            seconds=(last - ticks) / TICKS_PER_SECOND,
            frames=self._frames(row, ticks, reports),
            actions=[command_words(float(one["steering"]), float(one["speed"])) for one in reports],
            driven_mps=reports["driven_speed"].copy(),
            centre_share=2.0 * reports["centre_distance"] / np.maximum(reports["track_width"], 1e-9),
            rewards=rewards,
            lines=lines,
        )

    def _frames(self, row: int, ticks: Array, reports: Array) -> Array:
        """Return what a camera like the car's saw at some ticks, in colour and with what stood in the way."""
        camera = Camera(self.scene, *FRAME, self.car.mount)
        poses = np.column_stack([reports["x"], reports["y"], reports["yaw"]])
        boxes = None
        if "object.boxes" in self.drives.states[0]:
            stood = np.array([self.drives.states[tick]["object.boxes"][row] for tick in ticks])
            kinds = np.tile(self.worlds(1).kinds, (len(ticks), 1))
            boxes = stood, kinds
        return np.asarray(camera.render_rgb(poses, boxes=boxes))

    def _paid(self, row: int, first: int) -> tuple[Array | None, list[RewardLine]]:
        """Return what a row's car was paid from a tick on, and how: its episode is driven again with the reward."""
        path = self.car.run.reward_function
        if not path.is_file():
            return None, []
        try:
            with contextlib.closing(open_reward(path, io.StringIO())) as reward:  # what it prints is not for here
                ticks = list(_drive_again(self.worlds(1), self.drives, row, reward.copies(1), first))
        except (RewardFileError, RewardError) as error:
            self.reward_note = str(error).splitlines()[0]
            return None, []
        lines = []
        for term in sorted({term for _, terms in ticks for term in terms}):
            values = np.array([terms.get(term, np.nan) for _, terms in ticks])
            lines.append(RewardLine(term.line, term.name, line_of(reward.source, term), values))
        return np.array([paid for paid, _ in ticks]), lines


def _drive_again(
    world: RaceWorld, drives: RecordedDrives, row: int, reward: RewardCopies, first: int
) -> Iterator[tuple[float, dict[Term, float]]]:
    """Drive a row's episode again, told what it did; yield each tick's pay and its terms from a tick on."""
    buffers, last = allocate(world.spec), int(drives.last[row])
    world.load_state(states_of(drives, np.zeros(1, int), np.array([row])), buffers)
    world.reward = reward
    for tick in range(last + 1):
        reward.is_traced = tick >= first
        world.step(drives.actions[tick, [row]][:, None], buffers)
        if tick >= first:
            yield float(buffers.reward[0, 0]), reward.terms


def _commonest(reports: Array) -> tuple[tuple[float, float], int]:
    """Return the command most of some cars were given, (steering in rad, speed in m/s), and their middle waypoint."""
    commands = Counter(zip(reports["steering"].round(3).tolist(), reports["speed"].round(2).tolist(), strict=True))
    waypoints = reports["waypoint_nearest"]
    return commands.most_common(1)[0][0], int(waypoints[len(waypoints) // 2])


def _path(drives: RecordedDrives, row: int) -> Array:
    reports = drives.of(int(row))
    return np.column_stack([reports["front_x"], reports["front_y"]])
