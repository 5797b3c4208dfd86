"""Bring a game home that was played elsewhere."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option
from racecraft.worlds.battlesnake.actions.options import check_folder


@dataclass(frozen=True, kw_only=True)
class ImportGameRequest(Request):
    """Which files are read, and what is written."""

    files: tuple[Path, ...] = argument("The game, or its pieces; may be gzipped.", metavar="FILE...")
    out: Path = option(Path("game.jsonl"), "The file to write.", "--out", "-o")
    game: int | None = option(None, "Which, of a file that holds several.", low=1)


@dataclass(frozen=True)
class ImportedGame:
    """The file that was written, and what the game was."""

    file: Path
    snakes: list[str]
    turns: int
    over: bool
    winner: str
    """Empty: nobody."""
    mismatches: int
    """Turns that our rules would have ended otherwise."""


@action
def import_game(request: ImportGameRequest, progress: Progress = quiet) -> ImportedGame:
    """Bring a game home that was played elsewhere: to watch, to film, to study.

    It takes what an engine tells of a game: the arena's /api/games/ID/details; the answers for /games/ID together with
    the pages for /games/ID/frames; or the events that a board is sent. It also takes a snake's own log of a production
    game, and whatever else `snakes verify` takes. Every turn is replayed by our rules, and what differs is counted.

    Example: racecraft snakes import details.json --out game.jsonl

    Example: racecraft snakes import info.json frames.json --out game.jsonl

    Example: racecraft snakes import events.jsonl.gz --out game.jsonl && racecraft snakes study game.jsonl
    """
    from racecraft.worlds.battlesnake.evaluation.imported import import_game as read
    from racecraft.worlds.battlesnake.evaluation.record import write_record

    check_folder(request.out)
    found = read(request.files, request.game)
    played = found.played
    write_record(played, request.out)
    names = list(played.card.names.values())
    winner = played.card.names.get(played.winner, "")
    return ImportedGame(request.out, names, played.turns, played.over, winner, found.mismatches)
