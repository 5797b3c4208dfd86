"""What a judged drive says of a car's pace: fastest lap, gap to the best known one, steering, limits. See `Pace`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.known_laps import best_known_lap, direction_of, gap_percent
from racecraft.worlds.deepracer.driving.smoothness import Smoothness, smoothness_of
from racecraft.worlds.deepracer.env.vehicle import beyond_logs
from racecraft.worlds.deepracer.evaluation.laps import LapReport
from racecraft.worlds.deepracer.players.trained_car import TrainedCar


@dataclass(frozen=True)
class Pace:
    """The figures that racers compare."""

    best_lap_seconds: float | None
    """The fastest full lap; None without one."""
    best_known_seconds: float | None
    """The best known lap with the same car and top speed; None where the table has none."""
    smoothness: Smoothness | None
    """None where the car did not drive."""
    beyond_logs: str | None
    """What to say where the car is commanded faster than any log of it; None within the logs."""

    @property
    def gap_percent(self) -> float | None:
        """How much longer the fastest lap took than the best known one; None where one of them is missing."""
        if self.best_lap_seconds is None or self.best_known_seconds is None:
            return None
        return gap_percent(self.best_lap_seconds, self.best_known_seconds)

    def lines(self) -> list[str]:
        """Return what a reader is told, a line each; what is missing is a dash."""
        best, known, gap = self.best_lap_seconds, self.best_known_seconds, self.gap_percent
        lines = [
            f"fastest lap {_or_dash(best, '.2f', ' s')}; best known lap {_or_dash(known, '.2f', ' s')}; "
            f"gap {_or_dash(gap, '+z.1f', ' %')}"
        ]
        return [*lines, *([str(self.smoothness)] if self.smoothness else []), *filter(None, [self.beyond_logs])]

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures as plain values, fit for JSON."""
        return {
            "best_known_lap_seconds": self.best_known_seconds,
            "gap_percent": None if self.gap_percent is None else round(self.gap_percent, 2),
            **({} if self.smoothness is None else self.smoothness.as_dictionary()),
            "beyond_logs": self.beyond_logs,
        }


def pace_of(car: TrainedCar, track: str, report: LapReport, ticks: Array) -> Pace:
    """Return the pace of a judged drive.

    Args:
        car: Who drove.
        track: Name of the track.
        report: The judged laps.
        ticks: TICK_REPORT (T,) of the drive.
    """
    fastest = car.actions.fastest
    return Pace(
        report.best_lap_seconds,
        best_known_lap(track, car.settings.race.car, fastest, direction_of(car.settings.race.reverse)),
        smoothness_of(ticks),
        beyond_logs(car.settings.race.car, fastest),
    )


def _or_dash(value: float | None, form: str, unit: str) -> str:
    return "–" if value is None else f"{value:{form}}{unit}"
