"""One's own laps beside a leaderboard of AWS's. Begin with `placed`.

The archive's cars drove in another simulator, with penalties for leaving the road. Places are a neighbourhood, not a
result: OTHER_PHYSICS goes wherever they are shown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.worlds.deepracer.env.settings import HEAD_TO_BOT, OBJECT_AVOIDANCE, TIME_TRIAL
from racecraft.worlds.deepracer.evaluation.laps import LapReport
from racecraft.worlds.deepracer.files.leaderboards import AVERAGE, BEST, Entry, Leaderboard

OTHER_PHYSICS = (
    "The archive's times are of AWS's simulator, other physics with other penalties: read places as a neighbourhood, "
    "not as a result."
)

OWN_TYPES = {"TIME_TRIAL": TIME_TRIAL, "OBJECT_AVOIDANCE": OBJECT_AVOIDANCE, "HEAD_TO_HEAD_RACING": HEAD_TO_BOT}
"""Kinds of races in the archive, and what a car of ours drives there."""


@dataclass(frozen=True)
class Placed:
    """Where own laps would stand in a race."""

    board: Leaderboard
    own_seconds: float
    """By the race's own timing."""
    rank: int
    """From 1, among `racers` and oneself."""
    racers: int
    winner: Entry
    median_seconds: float


def own_score(laps: LapReport, board: Leaderboard) -> float | None:
    """Return what laps score in a race, s: the best so many full laps in a row; None where there are not so many."""
    seconds = [np.nan if lap.seconds is None else lap.seconds for lap in laps.laps]
    wanted = 1 if board.timing == BEST else board.laps
    if len(seconds) < wanted:
        return None
    sums = np.convolve(np.array(seconds), np.ones(wanted), "valid")
    if np.isnan(sums).all():
        return None
    total = float(np.nanmin(sums))
    return total / wanted if board.timing == AVERAGE else total


def placed(laps: LapReport, board: Leaderboard, race_type: str = TIME_TRIAL) -> Placed | None:
    """Return where laps would stand; None where they are too few, or the race has no racer who finished.

    Args:
        laps: One's own, in the order they were driven.
        board: The race.
        race_type: What was driven; a race of another kind gives no place.

    Raises:
        LeaderboardError: The race's table is damaged.
    """
    if OWN_TYPES.get(board.race_type) != race_type:
        return None
    own, entries = own_score(laps, board), board.entries()
    if own is None or not entries:
        return None
    scores = np.array([entry.score_seconds for entry in entries])
    return Placed(board, own, 1 + int((scores < own).sum()), len(entries), entries[0], float(np.median(scores)))
