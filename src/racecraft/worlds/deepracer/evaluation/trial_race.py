"""A race judged as the original judges it: trials, resets and penalties in simulated time. Begin with `judge_race`.

A car that leaves the road, stands still, drives backwards or hits an object is set back on the road where it was and
waits there while the clock runs (facts: deepracer.md 5.2, 5.3, 5.5, 5.6). It is set down in the nearer of two lanes, at
the progress of the tick before, nose along the road; where an object is too near, behind that and in the other lane.
Where its resets are used up, the trial ends as it stands. Continuous: the trials are laps of one drive, the first from
standstill; else each trial begins at rest on the start line.

The world knows none of this: it ends the episode, and is told to go on from another state.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, StepBuffers, allocate
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.kernels import localise, starts
from racecraft.worlds.deepracer.env.settings import RaceConfig
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS, TICKS_PER_SECOND
from racecraft.worlds.deepracer.env.world import RaceWorld

PAUSE = "pause"
MISHAPS = {
    race.CRASHED: "crashed",
    race.OFF_TRACK: "off_track",
    race.REVERSED: "reversed",
    race.IMMOBILISED: "immobilized",
}
RANGES: Mapping[str, tuple[float, float]] = {
    "number_of_trials": (1, 1000),
    "max_resets": (0, 10_000),
    "off_track_penalty": (0.0, 600.0),
    "collision_penalty": (0.0, 600.0),
    "reset_behind_dist": (0.0, 10.0),
}
"""Least and most of each number of a TrialRaceRules."""
CLOSEST_OBJECT_M = 1.0
"""A car is not set down so near to an object (facts: deepracer.md 5.5, CLOSEST_OBJ_GAP)."""


@dataclass(frozen=True)
class TrialRaceRules:
    """How a race is judged; names and defaults are those of DeepRacer for Cloud."""

    number_of_trials: int = 3
    """Laps that count, at least 1."""
    is_continuous: bool = True
    """Laps of one drive, instead of each from the start line."""
    max_resets: int = 100
    """How often a trial's car is set back; the next mishap ends it. Continuous: of all trials together."""
    off_track_penalty: float = 5.0
    """s that it waits after leaving the road or driving backwards; after standing still it does not."""
    collision_penalty: float = 5.0
    """s that it waits after hitting an object."""
    reset_behind_dist: float = 1.0
    """m behind an object that a car is set down, in the other lane, where its own place would be too near to it."""

    def __post_init__(self) -> None:
        """Refuse what no race can be.

        Raises:
            SettingError: A number is out of its range.
        """
        for name, (least, most) in RANGES.items():
            value = getattr(self, name)
            if not least <= value <= most:
                raise SettingError(
                    "{name} is {value:g}; expected {least:g} to {most:g}.",
                    name=name,
                    value=value,
                    least=least,
                    most=most,
                )

    @property
    def laps_in_one(self) -> int:
        """Laps that the world drives in one episode."""
        return self.number_of_trials if self.is_continuous else 1

    def race_config(self, config: RaceConfig, reverse: bool | None = None) -> RaceConfig:
        """Return a race's settings as they are judged: no start advances.

        Args:
            config: As it was trained.
            reverse: In the opposite direction to the track's own; None: as it was trained.
        """
        return replace(config, change_start=False, reverse=config.reverse if reverse is None else reverse)


@dataclass(frozen=True)
class Trial:
    """What a trial came to."""

    trial: int
    """Counted from 1."""
    seconds: float | None
    """Simulated seconds of a full lap, penalties in; None where it was not finished."""
    progress_percent: float
    """Share of the lap driven, 0 to 100."""
    status: str
    """How it ended: "lap_complete", or the mishap for which no reset was left, or "time_up"."""
    begin: int
    """Its first tick of the race, counted from 0."""
    end: int
    """Its last tick."""
    crash_count: int
    off_track_count: int
    reversed_count: int
    immobilized_count: int
    penalty_seconds: float
    """Simulated seconds that it waited."""

    @property
    def reset_count(self) -> int:
        """Mishaps of every kind, as the original's metrics count them."""
        return self.crash_count + self.off_track_count + self.reversed_count + self.immobilized_count


@dataclass(frozen=True, eq=False)
class RaceRecord:
    """A judged race, tick by tick and trial by trial."""

    trials: tuple[Trial, ...]
    ticks: Array
    """TICK_REPORT (T,); of a tick that was waited through the pose is where the car was set down."""
    status: Array
    """(T,) words: those of `race.STATUSES`, and "pause"."""
    pause_seconds: Array
    """(T,) s still to be waited."""
    trial: Array
    """(T,) number of the trial, counted from 1."""
    resets: Array
    """(T,) mishaps so far in this trial."""
    penalty_seconds: Array
    """(T,) s waited so far in this trial."""
    objects: tuple[Array, Array] | None
    """Boxes and bots in every tick, (T, K, 6) and their kinds (T, K), as `Objects` has them; None without any."""

    def __len__(self) -> int:
        return len(self.trials)

    @property
    def full_laps(self) -> int:
        """How many trials were driven to the end."""
        return sum(one.seconds is not None for one in self.trials)

    @property
    def best_lap_seconds(self) -> float | None:
        """The fastest full lap, penalties in; None without one."""
        return min((one.seconds for one in self.trials if one.seconds is not None), default=None)

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures as plain values, fit for JSON."""
        done = [one.seconds for one in self.trials if one.seconds is not None]
        return {
            "trials": [{**asdict(one), "reset_count": one.reset_count} for one in self.trials],
            "full_laps": self.full_laps,
            "best_lap_seconds": self.best_lap_seconds,
            "mean_lap_seconds": round(sum(done) / len(done), 6) if done else None,
            "total_seconds": round(len(self.ticks) * TICK_SECONDS, 6),
            "resets": sum(one.reset_count for one in self.trials),
            "penalty_seconds": sum(one.penalty_seconds for one in self.trials),
        }


def judge_race(policy: Policy, world: RaceWorld, rules: TrialRaceRules, seed: int = 0) -> RaceRecord:
    """Let a policy drive a race.

    Args:
        policy: Who drives.
        world: One car, made with `rules.race_config` and `laps=rules.laps_in_one`, its start share 0.
        rules: How it is judged.
        seed: Of what chance does to the car, where it does.
    """
    marshal = _Marshal(world, rules)
    buffers = allocate(world.spec)
    while not marshal.is_over:
        world.reset(buffers, seed + len(marshal.trials))
        policy.forget(np.ones(1, bool))
        marshal.begin()
        while marshal.goes_on:
            before = world.save_state()
            seen = {name: part.reshape(1, *part.shape[2:]) for name, part in buffers.observations.items()}
            actions = np.asarray(policy.act(seen))
            world.step(actions.reshape(1, 1, *world.spec.actions.shape), buffers)
            if marshal.judge(world.reports[0, 0]):
                crashed = int(world.reports[0, 0]["status"]) == race.CRASHED
                set_back(world, before, crashed, rules.reset_behind_dist, marshal.wait(), buffers)
                policy.forget(np.ones(1, bool))
    return marshal.record()


def set_back(
    world: RaceWorld,
    before: Mapping[str, Array],
    crashed: bool,
    behind_m: float,
    waited_ticks: int,
    buffers: StepBuffers,
) -> None:
    """Put the only car back on the road, at rest, with its lap's clock run on; objects stay where they were.

    Args:
        world: One car; the episode that its mishap ended goes on.
        before: The world's state before the tick of the mishap.
        crashed: It hit an object: its own place is where it is, not where it was a tick ago.
        behind_m: How far behind an object it is set down that is too near to its own place.
        waited_ticks: How long it waits there.
        buffers: What it sees from there is written.
    """
    car = np.zeros(1, race.CAR_STATE)
    for name in race.CAR_STATE.names or ():
        car[name] = before[f"car.{name}"].reshape(1)
    set_down(world, car, 0, crashed, behind_m)
    for name in ("ticks", "lap_ticks", "total_ticks"):  # the tick of the mishap counts, and so does waiting
        car[name] += 1 + waited_ticks
    state = {name: array.copy() for name, array in before.items()}
    for name in race.CAR_STATE.names or ():
        state[f"car.{name}"] = car[name].reshape(1, 1)
    world.load_state(state, buffers)


def set_down(world: RaceWorld, car: Array, n: int, crashed: bool, behind_m: float) -> None:
    """Put a car of world n, CAR_STATE (1,), back on the road at rest; what else it knows of its lap stays.

    Args:
        world: Where it drives.
        car: As it was before the tick of the mishap; written.
        n: Its world, whose objects are kept away from.
        crashed: It hit an object: its own place is where it is, not where it was a tick ago.
        behind_m: How far behind an object it is set down that is too near to its own place.
    """
    one = car[0]
    progress = float(one["progress"] if crashed else one["last_progress"])
    share = float((one["start_share"] + progress / 100.0) % 1.0)
    was = float(one["x"]), float(one["y"])
    car["x"], car["y"], car["yaw"] = _place(world, n, share, was, behind_m)
    for name in ("speed", "steering", "old_steering", "old_speed"):
        car[name] = 0.0
    car["preparing"] = False
    car["progress"] = progress
    localise.locate(world.track.arrays(), car[0])
    car["still_ticks"] = car["backward_ticks"] = 0


def _place(
    world: RaceWorld, n: int, share: float, was: tuple[float, float], behind_m: float
) -> tuple[float, float, float]:
    """Return the pose at which a car is set down: the lane nearer to where it was, or away from an object."""
    arrays, boxes = world.track.arrays(), world.boxes[n]
    x, y, _ = starts.start_pose(arrays, share, 0.0)
    gaps = np.hypot(boxes[:, 0] - x, boxes[:, 1] - y)
    blocked = len(gaps) > 0 and float(gaps.min()) <= CLOSEST_OBJECT_M
    if blocked:
        x, y = boxes[int(gaps.argmin()), :2]
        share = (float(world.track.locate(np.array([[x, y]])).arc[0]) - behind_m) / world.track.length % 1.0
    lanes = [starts.start_pose(arrays, share, side) for side in (race.START_LANE, -race.START_LANE)]
    left, right = (
        math.hypot(lane[0] - (x if blocked else was[0]), lane[1] - (y if blocked else was[1])) for lane in lanes
    )
    return lanes[0] if (left > right) == blocked else lanes[1]


@dataclass
class _Marshal:
    """Counts trials, resets and penalties, and writes every tick down."""

    world: RaceWorld
    rules: TrialRaceRules
    trials: list[Trial] = field(default_factory=list)
    is_over: bool = False
    goes_on: bool = False

    def __post_init__(self) -> None:
        self._rows: list[tuple[Array, str, float, int, int, float]] = []
        self._boxes: list[Array] = []
        self._resets_left = self.rules.max_resets
        self._begin = 0
        self._forget_trial()

    def begin(self) -> None:
        """A drive begins at the start line."""
        self.goes_on, self._resets_left = True, self.rules.max_resets

    def judge(self, report: Array) -> bool:
        """Write a tick down; tell whether the car is to be set back."""
        status, ended = int(report["status"]), bool(report["terminated"] | report["truncated"])
        mishap = MISHAPS.get(status) if ended else None
        if mishap is not None:
            self._counts[mishap] += 1
        out_of_time = ended and mishap is None and status != race.LAP_COMPLETE
        self._keep(report, "time_up" if out_of_time else race.STATUSES[status])
        if status == race.LAP_COMPLETE:
            self._end_trial(report, "lap_complete")
            self.goes_on = not ended
        elif mishap is not None and self._resets_left > 0:
            self._resets_left -= 1
            return True
        elif ended:
            self._end_trial(report, mishap or "time_up")
            self.goes_on = False
            self.is_over = self.is_over or self.rules.is_continuous
        return False

    def wait(self) -> int:
        """Let the clock run for what the last mishap costs; return how many ticks."""
        report, status = self._rows[-1][0].copy(), self._rows[-1][1]
        costs = {"immobilized": 0.0, "crashed": self.rules.collision_penalty}
        ticks = round(costs.get(status, self.rules.off_track_penalty) * TICKS_PER_SECOND)
        report["terminated"] = report["truncated"] = False
        report["speed"] = report["steering"] = report["driven_speed"] = report["driven_steering"] = 0.0
        for waited in range(1, ticks + 1):
            row = report.copy()
            row["steps"] += waited
            for clock in ("time", "lap_seconds"):
                row[clock] += waited * TICK_SECONDS
            self._waited += TICK_SECONDS
            self._keep(row, PAUSE, (ticks - waited) * TICK_SECONDS)
        return ticks

    def record(self) -> RaceRecord:
        """Return the race."""
        ticks, status, pause, trial, resets, penalty = zip(*self._rows, strict=True)
        kinds = self.world.kinds[0]
        return RaceRecord(
            tuple(self.trials),
            np.array(list(ticks), race.TICK_REPORT),
            np.array(status),
            np.array(pause),
            np.array(trial),
            np.array(resets),
            np.round(penalty, 6),
            (np.array(self._boxes), np.tile(kinds, (len(ticks), 1))) if kinds.size else None,
        )

    def _keep(self, report: Array, status: str, pause: float = 0.0) -> None:
        resets = sum(self._counts.values())
        self._rows.append((report.copy(), status, pause, len(self.trials) + 1, resets, self._waited))
        self._boxes.append(self.world.seen_boxes[0].copy())

    def _end_trial(self, report: Array, status: str) -> None:
        full = status == "lap_complete"
        self.trials.append(
            Trial(
                trial=len(self.trials) + 1,
                seconds=round(float(report["lap_seconds"]), 6) if full else None,
                progress_percent=min(max(float(report["progress"]), 0.0), 100.0),
                status=status,
                begin=self._begin,
                end=len(self._rows) - 1,
                crash_count=self._counts["crashed"],
                off_track_count=self._counts["off_track"],
                reversed_count=self._counts["reversed"],
                immobilized_count=self._counts["immobilized"],
                penalty_seconds=round(self._waited, 6),
            )
        )
        self.is_over = len(self.trials) >= self.rules.number_of_trials
        self._begin = len(self._rows)
        self._forget_trial()

    def _forget_trial(self) -> None:
        self._counts = dict.fromkeys(MISHAPS.values(), 0)
        self._waited = 0.0
