"""What all pages of races ask: the league, a race, who organises."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from starlette.requests import Request

from racecraft.accounts.rights import Verb, may
from racecraft.console.parts import RaceDrive
from racecraft.console.service import Console, person_of
from racecraft.contract.errors import SettingError
from racecraft.league.race import Race
from racecraft.league.snapshot import Snapshot, snapshot_of
from racecraft.league.store import MARK, League, shared_league
from racecraft.web.errors import WebError

DRIVES = 20
"""So many of a model's drives in races stand among its laps."""


def open_league(console: Console) -> League | None:
    """Return the league of a console; None: nobody has made a race yet."""
    return shared_league(console.league) if (console.league / MARK).is_file() else None


def league_of(console: Console) -> League:
    """Return the league of a console.

    Raises:
        WebError: Nobody has made a race yet.
    """
    league = open_league(console)
    if league is None:
        raise WebError(404, "no_race", "there are no races yet; make one first.")
    return league


def race_of(league: League, id: str) -> Race:
    """Return the race that an address names.

    Raises:
        WebError: There is none.
    """
    try:
        return league.race(id)
    except SettingError as error:
        message = f"this console has no race {id[:60]!r}; begin at /races."
        raise WebError(404, "no_such_race", message) from error


def snapshot_at(console: Console, request: Request) -> Snapshot:
    """Return the race that an address names, as it stands now.

    Raises:
        WebError: There is none.
    """
    league = league_of(console)
    return snapshot_of(league, race_of(league, request.path_params["id"]))


def drives_of(console: Console, request: Request, row: Mapping[str, Any]) -> list[RaceDrive]:
    """Return what a model of who asks drove in races, the newest first; at most DRIVES."""
    league = open_league(console)
    if league is None:
        return []
    owner, found = person_of(request).owned, list[tuple[float, RaceDrive]]()
    for race in (race for race in league.races() if race.kind == row["kind"]):
        entries = league.entries(race.id)
        own = {number for number, one in entries.items() if (one.model, one.person) == (row["name"], owner)}
        for result in league.results(race.id).values() if own else ():
            for seat in (seat for seat, number in enumerate(result.entries) if number in own):
                found += [
                    (result.judged, RaceDrive(race, drive.track, league.folder(race.id) / drive.folder, seat))
                    for drive in result.drives
                ]
    return [drive for _, drive in sorted(found, key=lambda one: -one[0])[:DRIVES]]


def shown_folder(request: Request, folder: Path) -> str:
    """Return a folder for a command; only who sees the machine is told where it lies."""
    return str(folder) if may(person_of(request), Verb.RUN_MACHINE) else folder.name


def organises(request: Request) -> bool:
    """Tell whether who asks makes and changes races."""
    return may(person_of(request), Verb.ORGANISE)


def log_act(console: Console, request: Request, what: str, which: str, **detail: Any) -> None:
    """Add a line to the log of what owners and organisers did."""
    if console.accounts is not None:
        console.accounts.log(person_of(request), what, which, **detail)
