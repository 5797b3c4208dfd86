"""Points over the races of a season. Begin with `standings`."""

from __future__ import annotations

import math
from dataclasses import dataclass

from racecraft.league.board import Board
from racecraft.league.race import QUALIFIER, Race, Season
from racecraft.league.snapshot import snapshot_of
from racecraft.league.store import League


@dataclass(frozen=True, kw_only=True)
class SeasonRow:
    """A racer in a season."""

    place: int
    racer: str
    points: int
    wins: int
    places: tuple[int | None, ...]
    """In each race, in the season's order; None: did not score."""
    race_points: tuple[int, ...]
    """Likewise; those of races that do not count are among them."""
    gap: int
    """Points to the first."""


@dataclass(frozen=True)
class Standings:
    """A season as it stands."""

    season: Season
    races: tuple[Race, ...]
    """In the order in which they were made."""
    rows: tuple[SeasonRow, ...]
    is_over: bool
    """All races are closed and judged: who is first is champion."""

    @property
    def leaders(self) -> tuple[str, ...]:
        """Who is first: one racer, or those between whom nothing decides; () before a result."""
        return tuple(row.racer for row in self.rows if row.place == 1)


def races_of(league: League, season: Season) -> list[Race]:
    """Return the races of a season, the oldest first."""
    return sorted((race for race in league.races() if race.season == season.id), key=lambda race: race.created)


def standings(league: League, season: Season, now: float) -> Standings:
    """Return who leads a season. A qualifier gives no points; of equal points more wins, then better places decide.

    Args:
        league: Where it is.
        season: Which.
        now: Seconds since 1970, for whether races are still open.
    """
    races = races_of(league, season)
    boards = [snapshot_of(league, race).board for race in races]
    placed = [{row.racer: row.place for row in board.rows} for board in boards]
    racers = sorted({racer for one in placed for racer in one})
    found = []
    for racer in racers:
        places = tuple(one.get(racer) for one in placed)
        points = tuple(_points(season, board, place) for board, place in zip(boards, places, strict=True))
        total = sum(sorted(points, reverse=True)[: season.counted])
        rank = (-total, -places.count(1), tuple(sorted(place or math.inf for place in places)))
        found.append((rank, racer, total, places, points))
    found.sort()
    ranks = [rank for rank, *_ in found]
    rows = [
        SeasonRow(
            place=1 + ranks.index(rank), racer=racer, points=total, wins=places.count(1), places=places,
            race_points=points, gap=found[0][2] - total,
        )
        for rank, racer, total, places, points in found
    ]  # fmt: skip
    is_over = bool(races) and all(
        not race.is_open(now) and not board.waiting for race, board in zip(races, boards, strict=True)
    )
    return Standings(season, tuple(races), tuple(rows), is_over)


def _points(season: Season, board: Board, place: int | None) -> int:
    if place is None or board.race.stage == QUALIFIER or place > len(season.points):
        return 0
    return season.points[place - 1]
