"""A track of one's own: from a drawing, and onto the floor."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.driving.drawn_bends import Bend
    from racecraft.worlds.deepracer.tracks.catalogue import TrackSummary
    from racecraft.worlds.deepracer.tracks.floor_print import FloorPrint, Tape

PAPERS = ("A4", "A3", "A0", "letter")


@dataclass(frozen=True, kw_only=True)
class MakeTrackRequest(Request):
    """A drawing, and what road it becomes."""

    file: Path = argument("A drawing: .svg, .gpx, a photographed outline (.png, .jpg), or points (.json, .csv).")
    name: str = option("", "What the track is called from now on; by default the file's name.")
    width: float = option(0.76, "Of the road.", unit="m", low=0.2, high=10.0)
    length: float | None = option(
        None, "Of the centre line; by default as drawn, where the drawing is in metres.", unit="m", low=1.0, high=200.0
    )
    smooth: float = option(0.2, "How far corners are rounded along the line.", unit="m", low=0.0, high=2.0)
    closed: bool | None = option(None, "Whether it is a loop; by default as drawn.", "--closed/--open")
    car: str = option("v6", "Car that has to get round: v4, v5-classic, v6, v6-unlimited or kinematic.")
    replace: bool = option(False, "Write over a track of your own of that name.")


@dataclass(frozen=True)
class MadeTrack:
    """A track that was kept in the user's own library."""

    track: TrackSummary
    file: Path
    """The waypoint file."""
    tape: Tape
    bends: list[Bend]
    """Bends that are tighter than the car turns."""


@action
def make_track(request: MakeTrackRequest, progress: Progress = quiet) -> MadeTrack:
    """Make a track from a drawing and keep it in your own library, under a name that all commands take.

    The line is scaled to --length, smoothed, and gets borders on both sides. A line that crosses itself or bends more
    tightly than its width allows is refused; bends that are tighter than the car turns are named.

    Examples:

        racecraft tracks make garage.svg --length 12 --width 0.6

        racecraft tracks make photo.jpg --name garage --length 12 --replace

        racecraft tracks print garage --out garage.pdf

    Raises:
        UserInputError: The drawing makes no track, or the name is taken.
    """
    from racecraft.contract.errors import SettingError, nearest
    from racecraft.worlds.deepracer.driving.drawn_bends import bend_remarks
    from racecraft.worlds.deepracer.env.vehicle import PROFILES
    from racecraft.worlds.deepracer.tracks.drawings import read_drawing
    from racecraft.worlds.deepracer.tracks.floor_print import tape_of
    from racecraft.worlds.deepracer.tracks.library import keep_track, library_folder, own_summary
    from racecraft.worlds.deepracer.tracks.make import RoadPlan
    from racecraft.worlds.deepracer.tracks.make import make_track as road_of

    if request.car not in PROFILES:
        raise SettingError(
            "--car is {car!r}; expected one of {profiles}. {hint}",
            car=request.car,
            profiles=", ".join(PROFILES),
            hint=nearest(request.car, PROFILES),
        )
    plan = RoadPlan(request.width, request.length, request.smooth, request.closed)
    name = request.name or request.file.stem
    track = road_of(read_drawing(request.file), plan, name, request.file)
    keep_track(track, request.file, replace=request.replace)
    bends = bend_remarks(track, PROFILES[request.car])
    return MadeTrack(own_summary(name), library_folder() / f"{name}.npy", tape_of(track), bends)


@dataclass(frozen=True, kw_only=True)
class PrintTrackRequest(Request):
    """Which track, on which paper."""

    track: str = argument("A name from `racecraft tracks list`, or a waypoint file (.npy).")
    out: Path | None = option(None, "The PDF to write; by default TRACK.pdf.")
    paper: str = option("A4", "A4, A3, A0 or letter.", choices=PAPERS)


@action
def print_track(request: PrintTrackRequest, progress: Progress = quiet) -> FloorPrint:
    """Print a track to scale: PDF pages to lay side by side on the floor and tape over, with a bill of tape.

    Example: racecraft tracks print garage --out garage.pdf --paper A3

    Raises:
        UserInputError: There is no such track, it takes too many pages, or the file cannot be written.
    """
    from racecraft.worlds.deepracer.tracks.catalogue import load_track
    from racecraft.worlds.deepracer.tracks.floor_print import print_floor

    track = load_track(request.track)
    return print_floor(track, request.out or Path(f"{track.name}.pdf"), request.paper)
