"""`racecraft snakes tournament`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from racecraft.cli.from_request import command
from racecraft.worlds.battlesnake.actions.tournament import HeldTournament
from racecraft.worlds.battlesnake.actions.tournament import tournament as action

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.evaluation.standings import Table


def _show(held: HeldTournament) -> None:
    _print(held.table)


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


tournament = command(action, _show, messages_aside=True)
