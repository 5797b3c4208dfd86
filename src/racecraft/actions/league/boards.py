"""Boards, and what races there are."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.league.options import LeagueOptions, RaceNamed
from racecraft.contract.progress import Progress, quiet
from racecraft.league.race import Race
from racecraft.settings.request import option

if TYPE_CHECKING:
    from racecraft.league.board import Board


@dataclass(frozen=True, kw_only=True)
class ListRequest(LeagueOptions):
    """All races of a league."""


@dataclass(frozen=True)
class RaceSummary:
    """A race in a list."""

    race: Race
    is_open: bool
    racers: int
    entries: int
    waiting: int
    """Entries that are still to be judged."""
    leader: str
    """"": nobody yet."""


@dataclass(frozen=True)
class RaceList:
    """The races of a league, the newest first."""

    races: tuple[RaceSummary, ...]


@action
def list_races(request: ListRequest, progress: Progress = quiet) -> RaceList:
    """List the races of a league, the newest first.

    Example: racecraft league list
    """
    from racecraft.league.snapshot import snapshot_of

    league, found = request.open(), []
    for race in league.races():
        now = snapshot_of(league, race)
        board, entries = now.board, now.entries
        first = next((row.racer for row in board.rows[:1] if row.place == 1), "")
        found.append(RaceSummary(race, race.is_open(time.time()), len(board.rows), len(entries), board.waiting, first))
    return RaceList(tuple(found))


@dataclass(frozen=True)
class ShownRace:
    """A race and its rules."""

    race: Race
    is_open: bool
    rules: tuple[str, ...]
    """A sentence each."""


@action
def show_race(request: RaceNamed, progress: Progress = quiet) -> ShownRace:
    """Show a race: where, its rules, what a car must be, until when.

    Example: racecraft league show club-evening
    """
    from racecraft.league.scoring import ranking_text
    from racecraft.league.world_part import league_world

    race = request.open().race(request.race)
    rules = league_world(race.kind).describe(race.rules, race.tracks)
    return ShownRace(race, race.is_open(time.time()), (*rules, f"ranked by {ranking_text(race)}"))


@dataclass(frozen=True, kw_only=True)
class BoardRequest(RaceNamed):
    """Whose board, and what stands beside it."""

    aws: Path | None = option(None, "Your copy of AWS's leaderboards: its races on the same track stand beside.")


@dataclass(frozen=True)
class ShownBoard:
    """A race's board."""

    board: Board
    history: tuple[dict[str, Any], ...] = ()
    """AWS's races on the same track, and where the leader's laps would stand."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return race, waiting entries and rows."""
        board = self.board
        return {
            "race": board.race.id, "title": board.race.title, "tracks": list(board.race.tracks),
            "ranking": board.race.ranking, "format": board.race.format, "waiting": board.waiting,
            "rows": [asdict(row) for row in board.rows], "history": list(self.history),
        }  # fmt: skip


@action
def show_board(request: BoardRequest, progress: Progress = quiet) -> ShownBoard:
    """Show who is where in a race, by how much, and which laps were driven.

    Examples:

        racecraft league board club-evening

        racecraft league board club-evening --aws deepracer-race-data
    """
    from racecraft.league.snapshot import snapshot_of
    from racecraft.league.world_part import league_world

    league = request.open()
    race = league.race(request.race)
    found = snapshot_of(league, race).board
    if request.aws is None:
        return ShownBoard(found)
    laps = found.rows[0].laps if found.rows else ()
    return ShownBoard(found, tuple(league_world(race.kind).history(race, laps, request.aws)))
