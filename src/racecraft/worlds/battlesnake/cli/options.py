"""Options that several `racecraft snakes` commands share, and taking seats at a board."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.evaluation.seats import Seat

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
FoodChance = Annotated[int, typer.Option("--foodSpawnChance", help="Percent, each turn.")]
MinimumFood = Annotated[int, typer.Option("--minimumFood", help="Food below this is filled up at once.")]
Damage = Annotated[int, typer.Option("--hazardDamagePerTurn", help="Health a hazard takes.")]
Shrink = Annotated[int, typer.Option("--shrinkEveryNTurns", help="Turns between two changes of the hazards.")]


def take_seats(who: list[str], names: list[str], seed: int, quiet: bool, memory_mb: int = 2048) -> list[Seat]:
    """Return a seat for everyone named; who stands there twice gets a number behind the name."""
    from racecraft.cli.output import say
    from racecraft.worlds.battlesnake.evaluation.seats import take_seat
    from racecraft.worlds.battlesnake.players.protocol import PlayerError

    if len(names) > len(who):
        players = "1 player" if len(who) == 1 else f"{len(who)} players"
        raise PlayerError(
            "{count} names for {players}; expected one player for every --name.", count=len(names), players=players
        )
    if any(one in ("area_control", "search") or one.startswith(("search+", "search:")) for one in who):
        say("Getting the players ready …", quiet_stdout=quiet)
    given = names + who[len(names) :]
    taken: list[Seat] = []
    for number, one in enumerate(who):
        twin = given[:number].count(given[number])
        name = f"{given[number]}#{twin + 1}" if twin else given[number]
        taken.append(take_seat(one, name, seed + number, memory_mb))
    return taken


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


def check_folder(path: Path | None) -> None:
    """Refuse a file to write whose folder is not there, before anything is played."""
    from racecraft.formats.atomic import OutputFileError

    if path is not None and not path.parent.is_dir():
        raise OutputFileError(
            "{path}: its folder does not exist. Create {parent} first.", path=path, parent=path.parent
        )
