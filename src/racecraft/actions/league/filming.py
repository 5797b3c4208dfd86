"""Film a judged drive."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.actions.league.options import RaceNamed
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import argument, option


@dataclass(frozen=True, kw_only=True)
class FilmRequest(RaceNamed):
    """Whose drive is filmed, and where to."""

    entry: int = argument("Number of the entry.", metavar="ENTRY")
    heat: str | None = option(None, "Name of the heat, as `board --json` has it; by default the entry's newest.")
    track: int = option(1, "Of a cup, which of its tracks.", low=1)
    out: Path | None = option(None, "File to write, .mp4; by default RACE-ENTRY.mp4.")


@dataclass(frozen=True)
class FilmedDrive:
    """A film of a judged drive."""

    race: str
    heat: str
    video: Path


@action
def film_race_drive(request: FilmRequest, progress: Progress = quiet) -> FilmedDrive:
    """Film a judged drive: it is driven again by its recorded actions before the camera.

    Examples:

        racecraft league film club-evening 3

        racecraft league film snake-evening 2 --heat meeting-00004 --out game.mp4

    Raises:
        UserInputError: Nothing of the entry was judged, or nothing here encodes films.
    """
    from racecraft.league.filming import film

    league = request.open()
    race = league.race(request.race)
    video = request.out or Path(f"{race.id}-{request.entry}.mp4")
    progress("Filming …")
    return FilmedDrive(race.id, film(league, race, request.entry, video, request.heat, request.track).heat, video)
