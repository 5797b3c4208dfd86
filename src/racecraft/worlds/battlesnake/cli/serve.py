"""`racecraft snakes serve`."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.worlds.battlesnake.actions.serve import ServedSnake
from racecraft.worlds.battlesnake.actions.serve import serve as action


def _show(served: ServedSnake) -> None:
    print(f"{served.player} answers at {served.url} (Ctrl-C ends)", flush=True)


serve = command(action, _show)
