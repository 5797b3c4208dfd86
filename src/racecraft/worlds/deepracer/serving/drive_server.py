"""The server of `racecraft drive`: one track, driven by hand. Begin with `make_drive_application`."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from racecraft.web.access import ONLY_HERE, Access
from racecraft.web.answers import page_answer
from racecraft.web.application import make_application
from racecraft.worlds.deepracer.analysis.ghosts import run_ghost
from racecraft.worlds.deepracer.driving.driven_laps import DrivenLaps
from racecraft.worlds.deepracer.serving.hand_driving import DrivenTrack, DriveTracks
from racecraft.worlds.deepracer.training.new_model import new_model

PAGE = "racecraft.worlds.deepracer.pages/drive.html"


def make_drive_application(
    track: str, folder: Path, reverse: bool = False, access: Access = ONLY_HERE, ghosts: Sequence[Path] = ()
) -> Starlette:
    """Return the application of one track.

    Args:
        track: A name of the catalogue, or a waypoint file.
        folder: The racer's folder, which keeps the laps; made where there is none.
        reverse: Whether the track is driven the other way round.
        access: Who may ask.
        ghosts: Runs whose fastest lap can be driven against.

    Raises:
        UserInputError: The folder or a file in it cannot be used, or there is no such track.
    """
    runs = {path.name: path for path in ghosts}
    driven = replace(driven_track(track, folder, reverse), runs=lambda: runs)
    circuit = driven.world().track
    for name, run in runs.items():
        run_ghost(run, circuit, name)
    tracks = DriveTracks(lambda name, is_reverse: driven)

    def page(request: Request) -> Response:
        about = f"Driven by hand; laps are kept in {driven.laps.path}."
        title = circuit.title or circuit.name
        return page_answer(request, PAGE, title=title, about=about, wheel="/wheel", track=track, runs=list(runs))

    async def wheel(socket: WebSocket) -> None:
        await tracks.answer(socket, track, reverse)

    return make_application([Route("/", page), WebSocketRoute("/wheel", wheel)], access)


def driven_track(track: str, folder: Path, reverse: bool) -> DrivenTrack:
    """Return a track and the laps that a racer's folder keeps of it.

    Raises:
        UserInputError: The folder or a file in it cannot be used.
    """
    if not folder.exists():
        new_model(folder)
    name = Path(track).stem + ("-reverse" if reverse else "")
    file = folder / f"laps-{name}.safetensors"
    words = ["racecraft", "train", str(folder), f"--track={track}", *(["--set=race.reverse=true"] if reverse else [])]
    command = shlex.join([*words, f"--from={file}"])
    return DrivenTrack(folder, track, reverse, DrivenLaps(file, Path(track).stem), command)
