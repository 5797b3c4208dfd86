"""`racecraft snakes import`."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.worlds.battlesnake.actions.import_game import ImportedGame
from racecraft.worlds.battlesnake.actions.import_game import import_game as action


def _show(done: ImportedGame) -> None:
    end = f"won by {done.winner}" if done.winner else "over" if done.over else "cut there"
    differ = f"; {done.mismatches} mismatches with our rules: `racecraft snakes verify` shows them"
    print(f"{done.file}: {', '.join(done.snakes)}; {done.turns} turns, {end}{differ * (done.mismatches > 0)}")


import_game = command(action, _show)
