"""A race judged as the original judges it: trials, resets and penalties in simulated time. Begin with `judge_race`.

A car that leaves the road, stands still, drives backwards or hits an object is first set back on the road
(`reset_pose.py`), then held there while the clock runs and bots drive on (facts: deepracer.md 5.2, 5.3, 5.5, 5.6). Its
policy keeps choosing, as in the original; the commands of a held car do nothing. Where its resets are used up, the
trial ends as it stands. Continuous: the trials are laps of one drive, the first from standstill; else each trial begins
at rest on the start line.

The world knows none of this: it ends the episode, and is told to go on from another state.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, StepBuffers, allocate
from racecraft.settings.table import setting
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.settings import RaceConfig
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS, TICKS_PER_SECOND
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.mishap_rules import MISHAPS, MishapRules
from racecraft.worlds.deepracer.evaluation.reset_pose import BoxResets, set_down


@dataclass(frozen=True)
class TrialRaceRules(MishapRules):
    """How a race is judged; names and defaults are those of DeepRacer for Cloud.

    `max_resets` counts for each trial; continuous: for all trials together.
    """

    number_of_trials: int = setting(3, "Laps that count.", low=1, high=1000)
    is_continuous: bool = setting(True, "Laps of one drive, instead of each from the start line.")
    reset_behind_dist: float = setting(
        1.0, "How far behind a box a car is set down, in the other lane, where its own place would be too near to it.",
        unit="m", low=0.0, high=10.0,
    )  # fmt: skip
    enable_mercy_reset: bool = setting(
        False, "A car that is set down at one box again and again goes on ahead of it (simapp ENABLE_MERCY_RESET)."
    )
    max_resets_after_crash: int = setting(
        3, "At the how-manieth reset in a row at one box that is, with mercy (simapp MAX_RESETS_AFTER_CRASH).",
        low=1, high=1000,
    )  # fmt: skip
    reset_ahead_dist: float = setting(
        1.0, "How far ahead of the box, with mercy (simapp RESET_AHEAD_DIST).", unit="m", low=0.0, high=10.0
    )
    race_seconds: float | None = setting(None, "When the race is over, waits in; None: trials alone end it.", unit="s")

    @property
    def laps_in_one(self) -> int:
        """Laps that the world drives in one episode."""
        return self.number_of_trials if self.is_continuous else 1

    def box_resets(self) -> BoxResets:
        """Return how far from a box a car goes on, before its first reset."""
        mercy_after = self.max_resets_after_crash if self.enable_mercy_reset else None
        return BoxResets(self.reset_behind_dist, self.reset_ahead_dist, mercy_after)

    def race_config(self, config: RaceConfig, reverse: bool | None = None) -> RaceConfig:
        """Return a race's settings as they are judged: no start advances.

        Args:
            config: As it was trained.
            reverse: In the opposite direction to the track's own; None: as it was trained.
        """
        return replace(config, change_start=False, reverse=config.reverse if reverse is None else reverse)


@dataclass(frozen=True)
class RaceTrial:
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
        """How often the car was set back: a mishap that ended the trial is none."""
        mishaps = self.crash_count + self.off_track_count + self.reversed_count + self.immobilized_count
        return mishaps - (self.status in MISHAPS.values())


@dataclass(frozen=True, eq=False)
class RaceRecord:
    """A judged race, tick by tick and trial by trial."""

    trials: tuple[RaceTrial, ...]
    ticks: Array
    """TICK_REPORT (T,); of a tick that was waited through the pose is where the car was set down, its command that of
    the policy, which did nothing."""
    status: Array
    """(T,) words: those of `race.STATUSES`, and "pause"."""
    pause_seconds: Array
    """(T,) s still to be waited; the penalty itself in the tick of a mishap."""
    trial: Array
    """(T,) number of the trial, counted from 1."""
    resets: Array
    """(T,) how often the car was set back so far in this trial."""
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


def judge_race(
    policy: Policy,
    world: RaceWorld,
    rules: TrialRaceRules,
    seed: int = 0,
    watch: Callable[[int, Array, int], None] = lambda trials, report, ticks: None,
) -> RaceRecord:
    """Let a policy drive a race.

    Args:
        policy: Who drives.
        world: One car, made with `rules.race_config` and `laps=rules.laps_in_one`, its start share 0.
        rules: How it is judged.
        seed: Of what chance does to the car, where it does.
        watch: Called after each tick with the trials that are over, its TICK_REPORT, and the number of ticks.
    """
    marshal, resets = _Marshal(world, rules), rules.box_resets()
    buffers = allocate(world.spec)
    while not marshal.is_over:
        world.reset(buffers, seed + len(marshal.trials))
        policy.reset_state(np.ones(1, bool))
        marshal.begin()
        while marshal.goes_on:
            before = world.save_state()
            seen = {name: part.reshape(1, *part.shape[2:]) for name, part in buffers.observations.items()}
            actions = np.asarray(policy.act(seen))
            world.step(actions.reshape(1, 1, *world.spec.actions.shape), buffers)
            if marshal.judge(world.reports[0, 0]):
                crashed = int(world.reports[0, 0]["status"]) == race.CRASHED
                set_back(world, before, crashed, resets, marshal.held_ticks, buffers)
                policy.reset_state(np.ones(1, bool))
            watch(len(marshal.trials), world.reports[0, 0], marshal.ticks)
    return marshal.record()


def set_back(
    world: RaceWorld,
    before: Mapping[str, Array],
    crashed: bool,
    resets: BoxResets,
    held_ticks: int,
    buffers: StepBuffers,
) -> None:
    """Put the only car back on the road, where it waits at rest, with its lap's clock run on.

    Args:
        world: One car; the episode that its mishap ended goes on.
        before: The world's state before the tick of the mishap.
        crashed: It hit an object: its own place is where it is, not where it was a tick ago.
        resets: How far from a box it goes on; counts.
        held_ticks: How long it is held there. They do not count for the limit of an episode.
        buffers: What it sees from there is written.
    """
    car = np.zeros(1, race.CAR_STATE)
    for name in race.CAR_STATE.names or ():
        car[name] = before[f"car.{name}"].reshape(1)
    set_down(world, car, 0, crashed, resets)
    for name in ("ticks", "lap_ticks", "total_ticks"):  # the tick of the mishap counts
        car[name] += 1
    car["held"] = held_ticks
    car["drive_ticks"] -= held_ticks
    state = {name: array.copy() for name, array in before.items()}
    for name in race.CAR_STATE.names or ():
        state[f"car.{name}"] = car[name].reshape(1, 1)
    world.load_state(state, buffers)


@dataclass
class _Marshal:
    """Counts trials, resets and penalties, and writes every tick down."""

    world: RaceWorld
    rules: TrialRaceRules
    trials: list[RaceTrial] = field(default_factory=list)
    is_over: bool = False
    goes_on: bool = False

    def __post_init__(self) -> None:
        self.held_ticks = 0
        """Ticks that the car still waits."""
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
        if status == race.PAUSE:
            self.held_ticks -= 1
            self._waited += TICK_SECONDS
        mishap = MISHAPS.get(status) if ended else None
        limit = self.rules.race_seconds
        is_last = limit is not None and self.ticks + 1 >= round(limit * TICKS_PER_SECOND)
        is_set_back = mishap is not None and self._resets_left > 0 and not is_last
        if mishap is not None:
            self._counts[mishap] += 1
        if is_set_back:
            self._resets_left -= 1
            self._resets += 1
            self.held_ticks = self.rules.waiting_ticks(status)
        out_of_time = (ended or is_last) and mishap is None and status != race.LAP_COMPLETE
        self._keep(report, "time_up" if out_of_time else race.STATUSES[status])
        if status == race.LAP_COMPLETE:
            self._end_trial(report, "lap_complete")
            self.goes_on = not ended and not is_last
        elif (ended and not is_set_back) or is_last:
            self._end_trial(report, mishap or "time_up")
            self.goes_on = False
            self.is_over = self.is_over or self.rules.is_continuous
        self.is_over = self.is_over or is_last
        return is_set_back

    @property
    def ticks(self) -> int:
        """How many were judged."""
        return len(self._rows)

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

    def _keep(self, report: Array, status: str) -> None:
        pause = self.held_ticks * TICK_SECONDS
        self._rows.append((report.copy(), status, pause, len(self.trials) + 1, self._resets, self._waited))
        self._boxes.append(self.world.seen_boxes[0].copy())

    def _end_trial(self, report: Array, status: str) -> None:
        full = status == "lap_complete"
        self.trials.append(
            RaceTrial(
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
        self._resets, self._waited = 0, 0.0
