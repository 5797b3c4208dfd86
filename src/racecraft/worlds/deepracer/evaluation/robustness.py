"""What of a car's laps survives when something is not as it was: one disturbance at a time, and all. See `judge_under`.

Every row of the report drives the same starts, spread evenly round the lap, one episode each; every episode draws its
own amounts within the level's ranges. The car is judged greedily, as everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from racecraft.contract.random_streams import generator
from racecraft.evaluation.rating import wilson
from racecraft.worlds.deepracer.env.settings import TIME_TRIAL
from racecraft.worlds.deepracer.env.variation import (
    VariationConfig,
    checked_disturbance,
    checked_level,
    disturbances_of,
    only,
)
from racecraft.worlds.deepracer.evaluation.laps import LapReport, judge_starts
from racecraft.worlds.deepracer.players.trained_car import TrainedCar
from racecraft.worlds.deepracer.tracks.track import Track

TRIES = 20
UNDISTURBED, ALL = "undisturbed", "all together"
RESAMPLES = 2000
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Bar:
    """What laps came to under one disturbance."""

    name: str
    """A disturbance, or UNDISTURBED, or ALL."""
    report: LapReport

    @property
    def interval(self) -> tuple[float, float]:
        """The mean progress, per cent, with CONFIDENCE between these two: a percentile bootstrap over the tries.

        Tries that all came equally far leave no width, however few they are.
        """
        progress = np.array([lap.progress_percent for lap in self.report.laps])
        drawn = generator(0, "resampled tries").integers(0, len(progress), (RESAMPLES, len(progress)))
        tail = 50.0 * (1.0 - CONFIDENCE)
        low, high = np.percentile(progress[drawn].mean(axis=1), (tail, 100.0 - tail))
        return float(low), float(high)

    def as_dictionary(self) -> dict[str, Any]:
        """Return the row as plain values, fit for JSON."""
        low, high = self.interval
        least, most = wilson(self.report.full_laps, len(self.report))
        ends: dict[str, int] = {}
        for lap in self.report.laps:
            ends[lap.status] = ends.get(lap.status, 0) + 1
        return {
            "disturbance": self.name,
            "tries": len(self.report),
            "full_laps": self.report.full_laps,
            "full_laps_share_low": round(least, 4),
            "full_laps_share_high": round(most, 4),
            "mean_progress_percent": round(self.report.mean_progress_percent, 3),
            "mean_progress_low": round(low, 3),
            "mean_progress_high": round(high, 3),
            "best_lap_seconds": self.report.best_lap_seconds,
            "ended": ends,
        }


@dataclass(frozen=True)
class RobustnessReport:
    """What an evaluation under disturbances came to."""

    level: str
    bars: tuple[Bar, ...]

    def as_dictionary(self) -> dict[str, Any]:
        """Return the report as plain values, fit for JSON."""
        return {"under": self.level, "confidence": CONFIDENCE, "bars": [bar.as_dictionary() for bar in self.bars]}


def judge_under(
    car: TrainedCar,
    track: Track,
    level: str,
    names: Sequence[str] = (),
    tries: int = TRIES,
    seed: int = 0,
    on_progress: Callable[[int, int], None] | None = None,
) -> Iterator[Bar]:
    """Judge a car without any disturbance, under each of those named, and under all of the level; yield as it goes.

    Args:
        car: Who drives.
        track: Where.
        level: How much differs: one of `variation.LEVELS` but "off".
        names: Disturbances that are tried each by itself.
        tries: Episodes for a row, from as many starts.
        seed: Of what is drawn.
        on_progress: Hears how many episodes of all bars have ended, and how many there are.

    Raises:
        SettingError: There is no such level or disturbance.
    """
    variations = [(UNDISTURBED, VariationConfig())]
    variations += [(name, only(level, [name])) for name in names]
    variations += [(ALL, VariationConfig(checked_level(level)))]
    starts = [place / tries for place in range(tries)]
    for index, (name, variation) in enumerate(variations):

        def hear(ended: int, before: int = index * tries) -> None:
            if on_progress is not None:
                on_progress(before + ended, tries * len(variations))

        hear(0)
        world = car.world(track, num_cars=tries, start_shares=starts, variation=variation)
        yield Bar(name, judge_starts(car.policy, world, seed=seed, on_progress=hear))


def requested_names(car: TrainedCar, level: str, each: bool, named: Iterable[str] = ()) -> list[str]:
    """Return the disturbances that are tried one by one: all that the level has, or those named.

    Raises:
        SettingError: There is no such level, or no such disturbance.
    """
    known = disturbances_of(level, car.settings.race.type != TIME_TRIAL)
    named = [checked_disturbance(name) for name in named]
    return named or (known if each else [])
