"""`racecraft snakes tournament`: everyone against everyone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.battlesnake.options import JSON, GameType, Height, MapName, Seed, Timeout, Width, take_seats

if TYPE_CHECKING:
    from racecraft.evaluation.battlesnake.tournament import Table


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
    json: JSON = False,
) -> None:
    """Play everyone against everyone, seats swapped; rate them (Elo points, and OpenSkill, with 95 % intervals).

    Example: racecraft snakes tournament flood_fill area_control my_snake.py --rounds 10
    """
    from racecraft.cli.output import print_json, say
    from racecraft.envs.battlesnake.settings import GameSettings
    from racecraft.evaluation.battlesnake.tournament import tournament as hold
    from racecraft.players.battlesnake.find import PLAYERS

    settings = GameSettings(width, height, snakes, gametype, map_name)
    seats = take_seats(who or list(PLAYERS), [], seed or 0, quiet=json)

    def told(played: object, number: int, games: int) -> None:
        if number % max(1, games // 10) == 0:
            say(f"{number} of {games} games", quiet_stdout=True)

    try:
        table = hold(seats, settings, rounds, timeout, seed or 0, most_turns, told)
    finally:
        for seat in seats:
            seat.leave()
    if json:
        print_json(table.to_dict())
    else:
        _print(table)


def _print(table: Table) -> None:
    heading = f"{'player':20} {'rating':>6} {'95 %':>13} {'OpenSkill':>13}"
    print(f"{heading} {'games':>6} {'won':>5} {'late':>5} {'failed':>6}")
    for line in table.standings:
        points = line.rating
        spread = f"{points.low:.0f} … {points.high:.0f}"
        skill = f"{line.skill.mu:.1f} ± {line.skill.high - line.skill.mu:.1f}"
        print(
            f"{line.name:20.20} {points.points:>6.0f} {spread:>13} {skill:>13} {line.games:>6} "
            f"{line.wins / line.games:>5.0%} {line.timeouts:>5} {line.crashes:>6}"
        )
