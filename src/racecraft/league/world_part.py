"""What a world brings to a league: `LeagueWorld`. Its kind names it by the hook `league`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Protocol

from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.kinds import find_kind
from racecraft.league.race import Outcome, Places, Race


@dataclass(frozen=True, kw_only=True)
class DriveOrder:
    """What is to be driven, as plain values."""

    rules: Mapping[str, Any]
    track: str
    """Its name; of one that the race has kept, the file."""
    seed: int
    """Not negative."""
    models: tuple[str, ...]
    """Folders that `admit` has filled, one an entry."""
    names: tuple[str, ...]
    """Names of the racers, likewise."""
    files: tuple[str, ...] = ()
    """Further files and folders that it reads: tracks that the race has kept."""


@dataclass(frozen=True)
class Driven:
    """What a drive came to."""

    outcomes: tuple[Outcome, ...]
    """In the order of the entries."""
    files: Mapping[str, bytes]
    """What is kept of it, by path below the folder of the drive."""


OnProgress = Callable[[float, str, Places], None]
"""Is called with how much of a heat is driven, 0 to 1, the same for people, and where each car is."""


def no_progress(share: float, text: str, places: Places) -> None:
    """Do nothing."""


class LeagueWorld(Protocol):
    """A world in a league."""

    def admit(self, source: str, folder: Path, rules: Mapping[str, Any]) -> dict[str, Any]:
        """Copy a model into an empty folder, so that it can be driven from there, and return its facts.

        Raises:
            UserInputError: It cannot be used, or a rule forbids it; the message says which.
        """

    def name_of(self, source: str) -> str:
        """Return what a board calls a model."""

    def describe(self, rules: Mapping[str, Any], tracks: Sequence[str]) -> list[str]:
        """Return the rules, a line each."""

    def is_alone(self, order: DriveOrder) -> bool:
        """Tell whether a drive needs no other processes and machines: its own can then be limited to computing."""

    def warm_up(self) -> None:
        """Import and compile what a drive needs, before there is one."""

    def drive(self, order: DriveOrder, on_progress: OnProgress) -> Driven:
        """Let the models drive, and call `on_progress` as often as one likes."""

    def redrive(self, order: DriveOrder, folder: Path) -> Driven:
        """Drive again by the actions that a drive has recorded in its folder."""

    def film(self, order: DriveOrder, folder: Path, video: Path, seen_from: int) -> None:
        """Film a judged drive, which is driven again by its recorded actions.

        Args:
            order: What was driven.
            folder: Of the drive.
            video: The file to write, .mp4.
            seen_from: Whose film it is: the place of its entry in the order.

        Raises:
            UserInputError: The files are missing or damaged, or nothing here encodes films.
        """

    def road(self, track: str) -> dict[str, Any] | None:
        """Return a track as a page shows it from above; None where there is no road.

        `inner` and `outer` border, (x, y) each in metres, x east, y north; `closed`.

        Args:
            track: Its name; of one that the race has kept, the file.
        """

    def shown(self, folder: Path) -> dict[str, Any]:
        """Return a judged drive as a page shows it from above: `tick_seconds`; `cars`: x, y, lap_seconds, laps by tick.

        Raises:
            UserInputError: Its files are missing or damaged.
        """

    def history(self, race: Race, laps: Sequence[float | None], archive: Path) -> list[dict[str, Any]]:
        """Return older boards on a race's track, and where these laps would stand: one row each, fit for JSON.

        Args:
            race: The race.
            laps: Of its leader, s; None: not completed.
            archive: The user's copy of the older boards.

        Raises:
            UserInputError: The archive cannot be read.
        """

    def canonical_track(self, name: str) -> str:
        """Return the name by which boards compare a track.

        Raises:
            UserInputError: There is no such track.
        """


def league_world(kind: str) -> LeagueWorld:
    """Return a world's part of a league.

    Raises:
        SettingError: The world is missing, or has none.
    """
    part = find_kind(kind).piece("league")
    if part is None:
        raise SettingError("the world {kind!r} has no races; expected one with a part for leagues.", kind=kind)
    made: LeagueWorld = part()
    return made


def require_known_rules(rules: type, names: Iterable[str]) -> None:
    """Refuse a name that a world's rules, a dataclass, do not have.

    Raises:
        SettingError: There is no such rule; the nearest one is named.
    """
    known = [one.name for one in fields(rules)]
    for name in names:
        if name not in known:
            raise SettingError("there is no rule {name!r}. {hint}", name=name, hint=nearest(name, known))
