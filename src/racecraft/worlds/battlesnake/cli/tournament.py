"""`racecraft snakes tournament`: everyone against everyone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.worlds.battlesnake.cli.options import (
    JSON,
    FileMemory,
    GameType,
    Height,
    MapName,
    Seed,
    Timeout,
    Width,
    aside,
    check_folder,
    take_seats,
)

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.evaluation.match import Played
    from racecraft.worlds.battlesnake.evaluation.standings import Table
    from racecraft.worlds.battlesnake.evaluation.tournament import Tournament
    from racecraft.worlds.battlesnake.evaluation.tournament_file import TournamentFile

INTERRUPTED = 130


def tournament(
    who: Annotated[list[str] | None, typer.Argument(help="Players: names, addresses, FILE.py; default: all.")] = None,
    snakes: Annotated[int, typer.Option(help="Snakes at a board.")] = 2,
    rounds: Annotated[int, typer.Option(min=1, help="Dice each group meets with, at every rotation of seats.")] = 3,
    width: Width = 11,
    height: Height = 11,
    timeout: Timeout = 100,
    gametype: GameType = "standard",
    map_name: MapName = "standard",
    seed: Seed = 0,
    most_turns: Annotated[int, typer.Option("--most-turns", min=1, help="A longer game is a draw.")] = 1000,
    file: Annotated[
        Path | None, typer.Option("--file", help="Keep the games here; the same command goes on where it stopped.")
    ] = None,
    file_memory: FileMemory = 2048,
    json: JSON = False,
) -> None:
    """Play everyone against everyone, seats swapped; rate them (Elo points with 95 % intervals).

    Ctrl-C ends it with the table of the games played so far.

    Example: racecraft snakes tournament flood_fill area_control my_snake.py --rounds 10

    Example: racecraft snakes tournament search area_control --rounds 50 --file games.jsonl
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.evaluation.tournament import Tournament
    from racecraft.worlds.battlesnake.evaluation.tournament_file import TournamentFile
    from racecraft.worlds.battlesnake.players.find import PLAYERS

    check_folder(file)
    settings = GameSettings(width, height, snakes, gametype, map_name)
    seats = take_seats(who or list(PLAYERS), [], seed or 0, json, file_memory)
    try:
        names = [seat.name for seat in seats]
        kept = None if file is None else TournamentFile(file, names, settings, timeout, seed or 0, most_turns)
        held = Tournament(seats, settings, rounds, timeout, seed or 0, most_turns, kept.games if kept else ())
        broken_off = _hold(held, kept)
    finally:
        for seat in seats:
            seat.leave()
    if json:
        print_json(held.table().to_dict())
    else:
        _print(held.table())
    if broken_off:
        raise typer.Exit(INTERRUPTED)


def _hold(held: Tournament, kept: TournamentFile | None) -> bool:
    """Play what is left and say every game; return whether it was broken off by Ctrl-C."""
    if held.games:
        aside(f"{len(held.games)} of {held.planned} games are in the file already.")
    try:
        for game, played in held.play():
            if kept is not None:
                kept.add(game)
            aside(f"game {game.number} of {held.planned}: {told(played)}")
    except KeyboardInterrupt:
        more = " The same command goes on from here." if kept is not None else ""
        aside(f"Broken off after {len(held.games)} of {held.planned} games.{more}")
        return True
    return False


def told(played: Played) -> str:
    """Return a game in a line: who won, and how the others left, the last first."""
    from racecraft.worlds.battlesnake.cli.play import fate

    snakes = sorted(played.boards[-1].snakes, key=lambda snake: -(snake.on if not snake.alive else 1 << 30))
    names = played.card.names
    parts = [f"{names[snake.id]} {fate(snake, played.card)}" for snake in snakes if snake.id != played.winner]
    won = f"{names[played.winner]} wins" if played.winner else "a draw"
    return f"{won} after {played.turns} turns; {', '.join(parts)}"


def _print(table: Table) -> None:
    heading = f"{'player':20} {'rating':>6} {'95 %':>13}"
    print(f"{heading} {'games':>6} {'won':>5} {'late':>5} {'failed':>6}")
    for line in table.standings:
        points = line.rating
        spread = f"{points.low:.0f} … {points.high:.0f}"
        won = f"{line.wins / line.games:.0%}" if line.games else "-"
        print(
            f"{line.name:20.20} {points.points:>6.0f} {spread:>13} {line.games:>6} "
            f"{won:>5} {line.timeouts:>5} {line.crashes:>6}"
        )
    if table.games < table.games_planned:
        print(f"{table.games} of {table.games_planned} games were played.")
    _print_head_to_head(table)


def _print_head_to_head(table: Table) -> None:
    names = [line.name for line in table.standings]
    width = max(9, *(len(str(score)) + 1 for scores in table.head_to_head.values() for score in scores.values()), 0)
    print(f"\n{'won-drawn-lost':20}" + "".join(f" {number:>{width}}" for number in range(1, len(names) + 1)))
    for number, name in enumerate(names, 1):
        scores = [str(table.head_to_head[name].get(other, "-" if other != name else "")) for other in names]
        label = f"{number} {name}"
        print(f"{label:20.20}" + "".join(f" {score:>{width}}" for score in scores))
