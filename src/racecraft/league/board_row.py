"""A racer's line on a board. See `BoardRow`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from racecraft.league.race import Result
from racecraft.league.scoring import best_lap_of

NO_FIGURES: Mapping[str, Any] = {
    "best_lap_seconds": None, "laps": (), "resets": 0, "penalty_seconds": 0.0, "heat": "", "judged": None,
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class BoardRow:
    """A racer's line."""

    place: int | None
    """Counted from 1; equal scores share it. None: no result that counts."""
    racer: str
    model: str
    """The model behind the best result."""
    entry: int
    """Its number."""
    score: float | None
    """Seconds, full laps, wins or rating points, as the race's format and ranking say."""
    gap: float | None
    """To the first, in the score's unit, 0 or more."""
    interval: float | None
    """To the racer in front."""
    best_lap_seconds: float | None
    laps: tuple[float | None, ...]
    """Of the best result; over a cup those of all tracks."""
    resets: int
    penalty_seconds: float
    submissions: int
    heat: str
    """Name of the best result: its replay and logs."""
    judged: float | None
    failure: str = ""
    """Why the newest entry could not be driven."""
    waiting: int = 0
    """Entries that are still to be judged."""
    score_range: tuple[float, float] | None = None
    """95 % interval of a rating."""
    games: int = 0
    """Of a ladder's entry."""
    wins: int = 0
    """Games in which it alone was first, likewise."""
    faults: int = 0
    """Moves that came late or were none, likewise."""


def figures_of(result: Result | None, index: int) -> dict[str, Any]:
    """Return what a row says of a result.

    Args:
        result: Judged; None: there is none.
        index: Which of its entries.
    """
    if result is None:
        return dict(NO_FIGURES)
    if index not in result.figures:
        outcomes = [drive.outcomes[index] for drive in result.drives]
        result.figures[index] = {
            "best_lap_seconds": best_lap_of(result, index),
            "laps": tuple(lap for outcome in outcomes for lap in outcome.laps),
            "resets": sum(outcome.resets for outcome in outcomes),
            "penalty_seconds": round(sum(outcome.penalty_seconds for outcome in outcomes), 3),
            "heat": result.heat,
            "judged": result.judged,
        }
    return result.figures[index]
