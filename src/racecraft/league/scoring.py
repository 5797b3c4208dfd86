"""From laps to a score: seconds, where less is better. Begin with `score_of`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from racecraft.league.race import AVERAGE, BEST, LADDER, LAPS, SOLO, TOTAL, Outcome, Race, Result


@dataclass(frozen=True)
class Score:
    """What a result is ranked by; the smaller one wins."""

    key: tuple[float, ...]
    """Compared from left to right."""
    value: float
    """What the board shows: seconds, or full laps."""


def score_of(race: Race, result: Result) -> Score | None:
    """Return the score of a solo result; None where a track has too few full laps. A cup adds its tracks up."""
    way = race.ranking, race.window
    if way not in result.scores:
        result.scores[way] = _computed(race, result)
    found: Score | None = result.scores[way]
    return found


def _computed(race: Race, result: Result) -> Score | None:
    scores = [_track_score(race, drive.outcomes[0]) for drive in result.drives]
    found = [one for one in scores if one is not None]
    if not found or len(found) < len(scores):
        return None
    key = tuple(sum(parts) for parts in zip(*(one.key for one in found), strict=True))
    return Score(key, sum(one.value for one in found))


def _track_score(race: Race, outcome: Outcome) -> Score | None:
    if race.ranking == LAPS:
        laps = [lap for lap in outcome.laps if lap is not None]
        return Score((-float(len(laps)), sum(laps)), float(len(laps))) if laps else None
    seconds = best_window(outcome.laps, 1 if race.ranking == BEST else race.window)
    if seconds is None:
        return None
    value = seconds / race.window if race.ranking == AVERAGE else seconds
    return Score((round(value, 6),), round(value, 6))


def best_window(laps: Sequence[float | None], count: int) -> float | None:
    """Return the least sum of so many consecutive full laps, s; None where there are none.

    >>> best_window([10.0, 11.0, None, 9.0, 10.5], 2), best_window([10.0, None, 9.0], 2)
    (19.5, None)
    """
    sums = []
    for first in range(len(laps) - count + 1):
        window = [lap for lap in laps[first : first + count] if lap is not None]
        if len(window) == count:
            sums.append(sum(window))
    return min(sums, default=None)


def best_lap_of(result: Result, place: int = 0) -> float | None:
    """Return the fastest full lap of a heat's entry on any of its tracks, s; None without one."""
    laps = (lap for drive in result.drives for lap in drive.outcomes[place].laps if lap is not None)
    return min(laps, default=None)


def ranking_text(race: Race) -> str:
    """Return what decides a race, for people.

    >>> ranking_text(Race(id="a", title="A", kind="k", tracks=("t",), rules={}, ranking="average", window=3))
    'mean of the best 3 consecutive laps'
    """
    if race.format != SOLO:
        return "rating, from every game" if race.format == LADDER else "wins, then seconds"
    return {
        BEST: "best lap",
        AVERAGE: f"mean of the best {race.window} consecutive laps",
        TOTAL: f"time of the best {race.window} consecutive laps",
        LAPS: "most laps, then their time",
    }[race.ranking]
