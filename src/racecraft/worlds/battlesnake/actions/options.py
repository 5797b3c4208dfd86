"""Options that several verbs of snakes share, and taking seats at a board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.contract.progress import Progress
from racecraft.settings.request import Request, option

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.evaluation.seats import Seat


FILE_MEMORY_HELP = "MB of memory a FILE.py may use; 0: no limit. (Linux)"


@dataclass(frozen=True, kw_only=True)
class BoardOptions(Request):
    """What is played, on which board."""

    width: int = option(11, "Squares from left to right.", "--width", "-W")
    height: int = option(11, "Squares from bottom to top.", "--height", "-H")
    gametype: str = option("standard", "Ruleset: standard, solo, royale, constrictor, …", "--gametype", "-g")
    map_name: str = option("standard", "Map: standard, empty, royale, arcade_maze, …", "--map", "-m")

    def settings(self, snakes: int) -> GameSettings:
        """Return the game of so many snakes; one alone plays for its length.

        Raises:
            SettingError: There is no such game.
        """
        from racecraft.worlds.battlesnake.env.settings import GameSettings

        solo = True if snakes < 2 else None
        return GameSettings(self.width, self.height, snakes, self.gametype, self.map_name, solo=solo)


def take_seats(
    who: Sequence[str], names: Sequence[str], seed: int, progress: Progress, memory_mb: int = 2048
) -> list[Seat]:
    """Return a seat for everyone named; who stands there twice gets a number behind the name."""
    from racecraft.worlds.battlesnake.evaluation.seats import take_seat
    from racecraft.worlds.battlesnake.players.protocol import PlayerError

    if len(names) > len(who):
        players = "1 player" if len(who) == 1 else f"{len(who)} players"
        raise PlayerError(
            "{count} names for {players}; expected one player for every --name.", count=len(names), players=players
        )
    if any(one in ("area_control", "search") or one.startswith(("search+", "search:")) for one in who):
        progress("Getting the players ready …")
    given = [*names, *who[len(names) :]]
    taken: list[Seat] = []
    for number, one in enumerate(who):
        twin = given[:number].count(given[number])
        name = f"{given[number]}#{twin + 1}" if twin else given[number]
        taken.append(take_seat(one, name, seed + number, memory_mb))
    return taken


def check_folder(path: Path | None) -> None:
    """Refuse a file to write whose folder is not there, before anything is played."""
    from racecraft.formats.atomic import OutputFileError

    if path is not None and not path.parent.is_dir():
        raise OutputFileError(
            "{path}: its folder does not exist. Create {parent} first.", path=path, parent=path.parent
        )


def new_seed() -> int:
    """Return a seed that nobody chose."""
    import secrets

    return secrets.randbits(31)
