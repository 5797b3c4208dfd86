"""`racecraft drive TRACK`: a car under one's own hands, in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.options import Json

PORT = 8300
FOLDER = Path("my-drive")


def drive(
    track: Annotated[str, typer.Argument(help="A name from `racecraft tracks list`, or a waypoint file (.npy).")],
    folder: Annotated[
        Path, typer.Argument(help="A car's folder, which keeps the laps; made where there is none.")
    ] = FOLDER,
    reverse: Annotated[bool, typer.Option("--reverse", help="Drive the track the other way round.")] = False,
    ghost: Annotated[
        list[Path] | None, typer.Option(metavar="RUN", help="A run of this track to drive against; several: repeat it.")
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(
            min=0, max=65535, help=f"By default {PORT} or, where it is taken, the next free; 0: any free one."
        ),
    ] = None,
    host: Annotated[str, typer.Option(help="Listen address; 0.0.0.0: all interfaces, with a token.")] = "127.0.0.1",
    open_it: Annotated[bool, typer.Option("--open/--no-open", help="Open it in the browser.")] = True,
    json: Json = False,
) -> None:
    """Drive a track by hand in the browser, until Ctrl-C; a car can learn from the laps.

    Keys, a gamepad, or buttons on a touch screen. The car answers as in a training, 15 times a second. Every complete
    lap is kept in FOLDER/laps-TRACK.safetensors, which --from takes: the training begins with a clone of them. On
    another machine's browser gamepads and tilting need a secure address (https), keys and buttons do not.

    Examples:

        racecraft drive reinvent_base

        racecraft drive Oval_track my-car --reverse

        racecraft train my-drive --track reinvent_base --from my-drive/laps-reinvent_base.safetensors
    """
    from racecraft.cli.output import print_json, say
    from racecraft.web.access import access_for
    from racecraft.web.browser import open_page
    from racecraft.web.ports import choose_port
    from racecraft.web.server import address_of, serve
    from racecraft.worlds.deepracer.serving.drive_server import make_drive_application

    access = access_for(host)
    application = make_drive_application(track, folder, reverse, access, ghost or ())
    chosen, note = choose_port(port, PORT)
    if note:
        say(note, quiet_stdout=json)

    def ready(port: int) -> None:
        address = address_of(host, port, access)
        print_json({"address": address, "folder": str(folder)}) if json else print(
            f"{track} at {address}; Ctrl-C ends it"
        )
        if open_it:
            open_page(address)

    serve(application, host, chosen, ready)
