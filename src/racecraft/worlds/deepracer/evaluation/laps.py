"""Judge a driver by laps: greedy, from given starts, on a world of its own."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, World
from racecraft.rollout.episodes import StepObserver, play_episodes
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.multi_course import MultiCourseWorld
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.compiled_drive import compiled_drive

UNFINISHED_MS = 999_999.0
"""What an unfinished lap counts where checkpoints are compared by lap time (facts: simapp `s3_metrics.py`)."""
UNFINISHED_LAPS = 2
"""What it counts where they are compared by pace: it is driven once more."""


@dataclass(frozen=True)
class Lap:
    """One lap, or as much of it as was driven."""

    start_percent: float
    """Where it began, per cent of the track from the start line."""
    progress_percent: float
    """How much of the lap was driven, 0 to 100."""
    seconds: float | None
    """Simulated seconds of a full lap; None where the lap was not finished."""
    status: str
    """How it ended: "lap_complete", "off_track", "immobilized", "reversed", "truncated"."""
    steps: int
    """Ticks driven."""
    reward: float | None = None
    """What the reward function paid for it; None where none was asked."""

    @property
    def is_full(self) -> bool:
        """The whole lap was driven."""
        return self.status == race.STATUSES[race.LAP_COMPLETE]


@dataclass(frozen=True)
class LapReport:
    """What an evaluation came to."""

    laps: tuple[Lap, ...]

    def __len__(self) -> int:
        return len(self.laps)

    @property
    def full_laps(self) -> int:
        """How many laps were driven to the end."""
        return sum(lap.is_full for lap in self.laps)

    @property
    def all_full(self) -> bool:
        """Every lap was driven to the end."""
        return self.full_laps == len(self.laps)

    @property
    def mean_progress_percent(self) -> float:
        """Mean share of the lap that was driven, per cent."""
        return float(np.mean([lap.progress_percent for lap in self.laps]))

    @property
    def best_lap_seconds(self) -> float | None:
        """Simulated seconds of the fastest full lap; None without one."""
        return min((lap.seconds for lap in self.laps if lap.seconds is not None), default=None)

    def merit(self, by: str) -> float:
        """Return how good this is by "progress" (mean per cent), "reward" (mean), "laptime" or "pace" (ms, negative).

        An unfinished lap counts UNFINISHED_MS by lap time, and by pace as many laps as UNFINISHED_LAPS says.

        >>> one_of_two = LapReport((Lap(0, 100, 12.5, "lap_complete", 188), Lap(0, 40, None, "off_track", 90)))
        >>> one_of_two.merit("laptime"), one_of_two.merit("pace")
        (-506249.5, -18750.0)
        """
        if by == "pace":
            finished = [1000.0 * lap.seconds for lap in self.laps if lap.seconds is not None]
            share = len(finished) / len(self)
            return -float(np.mean(finished)) * (share + UNFINISHED_LAPS * (1.0 - share)) if finished else -UNFINISHED_MS
        if by == "laptime":
            times = (UNFINISHED_MS if lap.seconds is None else 1000.0 * lap.seconds for lap in self.laps)
            return -float(np.mean(list(times)))
        if by == "reward":
            return float(np.mean([lap.reward or 0.0 for lap in self.laps]))
        return self.mean_progress_percent

    def as_dictionary(self) -> dict[str, Any]:
        """Return the report as plain values, fit for JSON."""
        return {
            "laps": [asdict(lap) for lap in self.laps],
            "full_laps": self.full_laps,
            "mean_progress_percent": round(self.mean_progress_percent, 3),
            "best_lap_seconds": self.best_lap_seconds,
        }


def judge_starts(
    policy: Policy,
    world: RaceWorld | MultiCourseWorld,
    observers: Iterable[StepObserver] = (),
    seed: int = 0,
    on_progress: Callable[[int], None] | None = None,
) -> LapReport:
    """Judge one episode from every start of a world, all side by side; in compiled code where nobody looks on.

    Args:
        policy: Who drives.
        world: Where.
        observers: Called after each step.
        seed: Of the world.
        on_progress: Hears how many of the episodes have ended, whenever it changes.
    """
    observers = tuple(observers)
    drive = None if observers else compiled_drive(policy, world)
    if drive is not None:
        episodes = drive.episodes(seed)
        if on_progress is not None:
            on_progress(len(episodes))
    else:
        counters = [] if on_progress is None else [_EndedEpisodes(on_progress)]
        episodes = play_episodes(policy, world, seed=seed, observers=[*observers, *counters])
    starts, has_reward = world.start_shares, world.has_reward
    return LapReport(tuple(_lap_of(episode, 100.0 * float(starts[episode.world]), has_reward) for episode in episodes))


class _EndedEpisodes:
    """An observer that counts the worlds whose episode has ended."""

    def __init__(self, on_progress: Callable[[int], None]) -> None:
        self._on_progress = on_progress
        self._ended: set[int] = set()

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        ended = np.flatnonzero((buffers.terminated | buffers.truncated).any(axis=1)).tolist()
        if not self._ended.issuperset(ended):
            self._ended.update(ended)
            self._on_progress(len(self._ended))


def judge_laps(policy: Policy, world: RaceWorld, laps: int, observers: Sequence[StepObserver] = ()) -> LapReport:
    """Judge so many laps of one car: a standing start, then flying laps; after leaving the road a new standing start.

    `world` has one car and was made with `laps=laps`. Where chance has a hand in its ticks (fidelity aws) every try
    draws anew, and the same evaluation draws the same again.
    """
    keeper = _LapKeeper(laps)
    drive = None if observers else compiled_drive(policy, world)
    for attempt in itertools.count():
        if drive is not None:
            drive.episode(attempt, keeper.record)
        else:
            play_episodes(policy, world, seed=attempt, observers=[*observers, keeper])
        if keeper.is_full:
            break
    return LapReport(tuple(keeper.laps))


class _LapKeeper:
    """An observer that writes down every lap of the only car."""

    def __init__(self, wanted: int) -> None:
        self.laps: list[Lap] = []
        self._wanted = wanted

    @property
    def is_full(self) -> bool:
        return len(self.laps) >= self._wanted

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        assert isinstance(world, RaceWorld)
        self.record(world)

    def record(self, world: RaceWorld) -> None:
        """Look at what the car's tick came to."""
        report = world.reports[0, 0]
        full = report["status"] == race.LAP_COMPLETE
        if self.is_full or not (full or report["terminated"] or report["truncated"]):
            return
        status = "truncated" if report["truncated"] and not full else race.STATUSES[report["status"]]
        seconds = round(float(report["lap_seconds"]), 6) if full else None
        ticks = round(float(report["lap_seconds"]) * TICKS_PER_SECOND)
        progress = min(max(float(report["progress"]), 0.0), 100.0)
        self.laps.append(Lap(100.0 * float(report["start_share"]), progress, seconds, status, ticks))


def _lap_of(episode: EpisodeRecord, start_percent: float, has_reward: bool) -> Lap:
    seconds = episode.facts["lap_seconds"]
    return Lap(
        start_percent=round(start_percent, 6),
        progress_percent=min(max(episode.facts["progress_percent"], 0.0), 100.0),
        seconds=None if math.isnan(seconds) else round(seconds, 6),
        status=episode.status,
        steps=episode.steps,
        reward=episode.reward if has_reward else None,
    )
