"""Checks of lessons S3 to S6: what a tournament shows, what four trainings came to, and a pupil's learned snake.

What plays is imported where it is needed: the first page of the course shall not wait for it.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.lessons.checking import Answer, Verdict, material, passed, predicted, tried

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.lessons.duel import Duel

GAMES, ENOUGH = 20, 14
LIMITS = {"games": GAMES, "enough": ENOUGH}
SEARCHED_GAMES, MILLISECONDS = 4, (30, 120)
"""Games of each time that search is given for a move."""


def facts() -> dict[str, Any]:
    """Return between whom the recorded tournament is undecided."""
    return {"undecided": ", ".join(row["pair"] for row in _pairs() if not _is_sure(row))}


def rating_points(answer: Answer) -> Verdict:
    """How many of 100 games a player wins that is 100, and 400, points ahead."""
    given, right = [answer.number(name) for name in ("near", "far")], [100 * expected_share(d) for d in (100, 400)]
    wrong = [abs(one - other) > 1 for one, other in zip(given, right, strict=True)]
    if any(wrong):
        at = wrong.index(True)
        return tried(("near_" if at == 0 else "far_") + ("low" if given[at] < right[at] else "high"), given=given[at])
    return passed(near=right[0], far=right[1])


def expected_share(points: float) -> float:
    """Return the share of games won by a player so many Elo points ahead.

    >>> round(expected_share(0), 2), round(expected_share(400), 2)
    (0.5, 0.91)
    """
    return 1.0 / (1.0 + 10.0 ** (-points / 400.0))


def open_pairs(answer: Answer) -> Verdict:
    """Of each pair of a tournament: is it sure who is better, or does the interval hold 50 %?"""
    rows = _pairs()
    for number, row in enumerate(rows, 1):
        if (answer.choice(f"pair{number}") == "sure") != _is_sure(row):
            return tried("not_sure" if not _is_sure(row) else "sure", **row)
    return passed(count=len(rows), undecided=facts()["undecided"])


def _pairs() -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = material(__package__, "tournament.json")["rows"]
    return rows


def _is_sure(row: dict[str, Any]) -> bool:
    return bool(row["low"] > 50 or row["high"] < 50)


def learned_beats(answer: Answer) -> Verdict:
    """A snake that a pupil has trained wins at least 14 of 20 games against the one that the pupil has written."""
    found = learned_duel(answer.code("code"), answer.model("snake"))
    values = {
        "lost": found.won,
        "won": found.lost,
        "games": GAMES,
        "enough": ENOUGH,
        "turns": round(found.turns / GAMES),
    }
    if found.failed:
        return tried("fails", **values, failed=found.failed, reason=found.reason)
    return passed(**values) if found.lost >= ENOUGH else tried("few" if found.lost > found.won else "weaker", **values)


def learned_duel(code: str, run: Path) -> Duel:
    """Return what code does in games against a trained snake."""
    from racecraft.worlds.battlesnake.lessons.duel import duel

    return duel(code, str(run), GAMES)


def four_runs(answer: Answer) -> Verdict:
    """A prediction: which of four ways of collecting learns most in half a minute on two cores?"""
    rows = material(__package__, "runs.json")["rows"]
    return predicted(answer, "reason", "ties", [(row["training"], *row["rewards"]) for row in rows])


def search_in_front(answer: Answer) -> Verdict:
    """A prediction: how does a learned snake fare against itself with search in front, by the time for a move?"""
    rows = searched(answer.model("snake"))
    (_, short), (_, long) = rows
    return predicted(answer, "reason", "replies", rows, short=short, long=long, games=SEARCHED_GAMES)


@cache
def searched(run: Path) -> list[tuple[int, int]]:
    """Return how many games search in front of a trained snake wins against it, by the milliseconds for a move."""
    from racecraft.worlds.battlesnake.lessons.duel import meet

    return [(time, meet(f"search+{run}", str(run), SEARCHED_GAMES, time).won) for time in MILLISECONDS]
