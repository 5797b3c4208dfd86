"""A car under one's own hands, in the browser."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.actions.action import action
from racecraft.actions.served_pages import ServedPages, listen
from racecraft.actions.watch import HOST_HELP, port_help
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

PORT = 8300
FOLDER = Path("my-drive")


@dataclass(frozen=True, kw_only=True)
class DriveRequest(Request):
    """Which track is driven, and where its page is."""

    track: str = argument("A name from `racecraft tracks list`, or a waypoint file (.npy).")
    folder: Path = argument("A car's folder, which keeps the laps; made where there is none.", FOLDER)
    reverse: bool = option(False, "Drive the track the other way round.")
    ghost: tuple[Path, ...] = option((), "A run of this track to drive against; several: repeat it.", metavar="RUN")
    port: int | None = option(None, port_help(PORT), low=0, high=65535)
    host: str = option("127.0.0.1", HOST_HELP)
    open_it: bool = option(True, "Open it in the browser.", "--open/--no-open")


@dataclass(frozen=True)
class ServedDrive(ServedPages):
    """The page on which a track is driven."""

    track: str
    folder: Path

    def as_dictionary(self) -> dict[str, Any]:
        """Return address and folder."""
        return {"address": self.address, "folder": self.folder}


@action
def drive(request: DriveRequest, progress: Progress = quiet) -> ServedDrive:
    """Drive a track by hand in the browser, until Ctrl-C; a car can learn from the laps.

    Keys, a gamepad, or buttons on a touch screen. The car answers as in a training, 15 times a second. Every complete
    lap is kept in FOLDER/laps-TRACK.safetensors, which --from takes: the training begins with a clone of them. On
    another machine's browser gamepads and tilting need a secure address (https), keys and buttons do not.

    Examples:

        racecraft drive reinvent_base

        racecraft drive Oval_track my-car --reverse

        racecraft train my-drive --track reinvent_base --from my-drive/laps-reinvent_base.safetensors
    """
    from racecraft.web.access import access_for
    from racecraft.worlds.deepracer.serving.drive_server import make_drive_application

    access = access_for(request.host)
    application = make_drive_application(request.track, request.folder, request.reverse, access, request.ghost)
    address, listening = listen(
        application, access, host=request.host, port=request.port, usual_port=PORT, progress=progress
    )
    return ServedDrive(address, listening, request.open_it, request.track, request.folder)
