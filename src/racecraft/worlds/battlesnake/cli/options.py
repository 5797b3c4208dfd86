"""Options that several `racecraft snakes` commands share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

JSON = Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")]
Urls = Annotated[
    list[str] | None, typer.Option("--url", "-u", help="A server's address, a built-in player, or a FILE.py.")
]
Names = Annotated[list[str] | None, typer.Option("--name", "-n", help="Its name, in the same order.")]
Width = Annotated[int, typer.Option("--width", "-W", help="Squares from left to right.")]
Height = Annotated[int, typer.Option("--height", "-H", help="Squares from bottom to top.")]
Timeout = Annotated[int, typer.Option("--timeout", "-t", min=1, help="Milliseconds for an answer.")]
GameType = Annotated[str, typer.Option("--gametype", "-g", help="Ruleset: standard, solo, royale, constrictor, …")]
MapName = Annotated[str, typer.Option("--map", "-m", help="Map: standard, empty, royale, arcade_maze, …")]
Seed = Annotated[int | None, typer.Option("--seed", "-r", help="Chance of the game; without it, another every time.")]
FileMemory = Annotated[
    int, typer.Option("--file-memory", min=0, help="MB of memory a FILE.py may use; 0: no limit. (Linux)")
]


def aside(sentence: str) -> None:
    """Say something to a person on standard error."""
    from racecraft.cli.output import say

    say(sentence, quiet_stdout=True)


def page_told(json: bool, stays: bool = False) -> Callable[[str], None]:
    """Return how the address of a page is told: as JSON where that is asked for and the page stays, else in words."""
    from racecraft.cli.output import print_json, say

    def tell(address: str) -> None:
        if json and stays:
            print_json({"url": address})
        else:
            say(f"Watch it at {address}{' (Ctrl-C ends)' * stays}", quiet_stdout=json)

    return tell
