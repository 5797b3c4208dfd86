"""Play everyone against everyone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option
from racecraft.worlds.battlesnake.actions.options import BoardOptions, check_folder, take_seats

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.env.board import Snake
    from racecraft.worlds.battlesnake.evaluation.match import Played
    from racecraft.worlds.battlesnake.evaluation.standings import Table
    from racecraft.worlds.battlesnake.evaluation.tournament import Tournament
    from racecraft.worlds.battlesnake.evaluation.tournament_file import TournamentFile
    from racecraft.worlds.battlesnake.players.messages import GameCard

INTERRUPTED = 130
"""Exit code after Ctrl-C."""


@dataclass(frozen=True, kw_only=True)
class TournamentRequest(Request):
    """Who plays, what, and how often."""

    who: tuple[str, ...] = argument("Players: names, addresses, FILE.py; default: all.", ())
    snakes: int = option(2, "Snakes at a board.")
    rounds: int = option(3, "Dice each group meets with, at every rotation of seats.", low=1)
    board: BoardOptions = group(BoardOptions)
    timeout: int = option(100, "Milliseconds for an answer.", "--timeout", "-t", low=1)
    seed: int | None = option(0, "Chance of the game; without it, another every time.", "--seed", "-r")
    most_turns: int = option(1000, "A longer game is a draw.", low=1)
    file: Path | None = option(None, "Keep the games here; the same command goes on where it stopped.")
    file_memory: int = option(2048, "MB of memory a FILE.py may use; 0: no limit. (Linux)", low=0)


@dataclass(frozen=True)
class HeldTournament:
    """The table of a tournament."""

    table: Table
    exit_code: int
    """130: Ctrl-C ended it before all games were played."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the table as plain values."""
        return self.table.to_dict()


@action
def tournament(request: TournamentRequest, progress: Progress = quiet) -> HeldTournament:
    """Play everyone against everyone, seats swapped; rate them (Elo points with 95 % intervals).

    Ctrl-C ends it with the table of the games played so far.

    Example: racecraft snakes tournament flood_fill area_control my_snake.py --rounds 10

    Example: racecraft snakes tournament search area_control --rounds 50 --file games.jsonl
    """
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.evaluation.tournament import Tournament
    from racecraft.worlds.battlesnake.evaluation.tournament_file import TournamentFile
    from racecraft.worlds.battlesnake.players.find import PLAYERS

    check_folder(request.file)
    board = request.board
    settings = GameSettings(board.width, board.height, request.snakes, board.gametype, board.map_name)
    seed = request.seed or 0
    seats = take_seats(request.who or list(PLAYERS), [], seed, progress, request.file_memory)
    try:
        names = [seat.name for seat in seats]
        kept = None
        if request.file is not None:
            kept = TournamentFile(request.file, names, settings, request.timeout, seed, request.most_turns)
        games = kept.games if kept else ()
        held = Tournament(seats, settings, request.rounds, request.timeout, seed, request.most_turns, games)
        broken_off = _hold(held, kept, progress)
    finally:
        for seat in seats:
            seat.leave()
    return HeldTournament(held.table(), INTERRUPTED if broken_off else 0)


def _hold(held: Tournament, kept: TournamentFile | None, progress: Progress) -> bool:
    """Play what is left and say every game; return whether it was broken off by Ctrl-C."""
    if held.games:
        progress(f"{len(held.games)} of {held.planned} games are in the file already.")
    try:
        for game, played in held.play():
            if kept is not None:
                kept.add(game)
            progress(f"game {game.number} of {held.planned}: {outcome(played)}")
    except KeyboardInterrupt:
        more = " The same command goes on from here." if kept is not None else ""
        progress(f"Broken off after {len(held.games)} of {held.planned} games.{more}")
        return True
    return False


def outcome(played: Played) -> str:
    """Return a game in a line: who won, and how the others left, the last first."""
    snakes = sorted(played.boards[-1].snakes, key=lambda snake: -(snake.on if not snake.alive else 1 << 30))
    names = played.card.names
    parts = [f"{names[snake.id]} {fate(snake, played.card)}" for snake in snakes if snake.id != played.winner]
    won = f"{names[played.winner]} wins" if played.winner else "a draw"
    return f"{won} after {played.turns} turns; {', '.join(parts)}"


def fate(snake: Snake, card: GameCard) -> str:
    """Return how a snake ended: what killed it, whose it was, and on which turn."""
    if snake.alive:
        return "alive"
    by = f" by {card.names.get(snake.by, snake.by)}" if snake.by not in ("", snake.id) else ""
    return f"{snake.cause}{by} on turn {snake.on}"
