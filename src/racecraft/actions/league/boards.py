"""Boards, and what races there are."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.league.options import LeagueOptions, RaceNamed
from racecraft.contract.progress import Progress, quiet
from racecraft.league.race import Race

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
    from racecraft.league.board import board_of

    league, found = request.open(), []
    for race in league.races():
        entries = league.entries(race.id)
        board = board_of(race, entries, league.results(race.id))
        first = next((row.racer for row in board.rows if row.place == 1), "")
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
    """Whose board."""


@dataclass(frozen=True)
class ShownBoard:
    """A race's board."""

    board: Board

    def as_dictionary(self) -> dict[str, Any]:
        """Return race, waiting entries and rows."""
        board = self.board
        return {
            "race": board.race.id, "title": board.race.title, "tracks": list(board.race.tracks),
            "ranking": board.race.ranking, "format": board.race.format, "waiting": board.waiting,
            "rows": [asdict(row) for row in board.rows],
        }  # fmt: skip


@action
def show_board(request: BoardRequest, progress: Progress = quiet) -> ShownBoard:
    """Show who is where in a race, by how much, and which laps were driven.

    Example: racecraft league board club-evening
    """
    from racecraft.league.board import board_of

    league = request.open()
    race = league.race(request.race)
    return ShownBoard(board_of(race, league.entries(race.id), league.results(race.id)))
