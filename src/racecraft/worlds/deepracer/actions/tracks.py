"""The catalogue of circuits, and the user's own beside it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.tracks.catalogue import TrackSummary


@dataclass(frozen=True, kw_only=True)
class TracksRequest(Request):
    """Nothing: all tracks are listed."""


@dataclass(frozen=True)
class TrackList:
    """Tracks by name, the user's own first."""

    tracks: list[TrackSummary]


@dataclass(frozen=True)
class ImportedTracks:
    """Tracks that were added to the user's own."""

    library: Path
    """The folder that they are kept in."""
    tracks: list[TrackSummary]


@action
def list_tracks(request: TracksRequest, progress: Progress = quiet) -> TrackList:
    """List every track by name, your own first, with length, width, direction and tags.

    Example: racecraft tracks list
    """
    from racecraft.worlds.deepracer.tracks.catalogue import names, summary

    return TrackList([*_own_summaries(progress), *map(summary, names())])


@dataclass(frozen=True, kw_only=True)
class ImportTracksRequest(Request):
    """Which files become tracks."""

    files: tuple[Path, ...] = argument("Waypoint files (.npy): centre, inner and outer x, y in metres.")
    name: str = option("", "What the track is called from now on; by default the file's name.")
    replace: bool = option(False, "Write over a track of your own of that name.")


@action
def import_tracks(request: ImportTracksRequest, progress: Progress = quiet) -> ImportedTracks:
    """Look at every row of a waypoint file and keep it in your own library.

    A file that makes no circuit is refused, and the row named where it shows; of several files all are kept or none.
    The library is a folder of your user account, or the one that the variable RACECRAFT_TRACKS names.

    Examples:

        racecraft tracks import garage.npy

        racecraft tracks import measured.npy --name garage --replace
    """
    from racecraft.worlds.deepracer.tracks.library import add_track, check_track, library_folder, own_summary

    if request.name and len(request.files) > 1:
        raise SettingError(
            "--name {name} would name {count} files; expected one file with it. Import it alone.",
            name=request.name,
            count=len(request.files),
        )
    if len({file.stem.casefold() for file in request.files}) < len(request.files):
        raise SettingError("Two of the files have one name; expected a name for each track. Import one of them --name.")
    for file in request.files:
        check_track(file, request.name, replace=request.replace)
    kept = [own_summary(add_track(file, request.name, replace=request.replace).name) for file in request.files]
    return ImportedTracks(library_folder(), kept)


@dataclass(frozen=True, kw_only=True)
class TrackRequest(Request):
    """Which track."""

    track: str = argument("A name from `racecraft tracks list`, or a waypoint file (.npy).")
    picture: Path | None = option(None, "Draw it into this PNG file.")


@action
def show_track(request: TrackRequest, progress: Progress = quiet) -> Figures:
    """Show what is known of a track; draw it.

    Example: racecraft tracks show reinvent_base --picture reinvent.png
    """
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    found = load_track(request.track)
    x0, y0, x1, y1 = found.bounds
    facts = {
        "name": found.name,
        "title": found.title,
        "length_m": round(found.length, 4),
        "width_mean_m": round(found.width_mean, 4),
        "direction": found.direction,
        "waypoints": len(found.of_filed_rows()),
        "bounds_m": [round(value, 3) for value in (x0, y0, x1, y1)],
        "hash": found.hash(),
    }
    if found.repeated_rows:
        facts["repeated"] = list(found.repeated_rows)
    if request.picture is not None:
        from racecraft.worlds.deepracer.tracks.picture import draw_track

        draw_track(found, request.picture)
    return Figures(facts, {} if request.picture is None else {"picture": request.picture})


def _own_summaries(progress: Progress) -> list[TrackSummary]:
    """Return the user's own tracks; a file that has been damaged since is reported and passed over."""
    from racecraft.contract.errors import TrackError
    from racecraft.worlds.deepracer.tracks.library import own_names, own_summary

    found = []
    for name in own_names():
        try:
            found.append(own_summary(name))
        except TrackError as error:
            progress(f"Left out: {error}")
    return found
