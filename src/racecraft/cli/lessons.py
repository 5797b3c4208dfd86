"""`racecraft lessons`: the course in the browser."""

from __future__ import annotations

from typing import Annotated

import typer

from racecraft.cli.options import Json

PORT = 8300


def lessons(
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
    """Open the course: learn reinforcement learning by doing it; until Ctrl-C.

    What is done is kept in this account's data folder; lesson 13 races the models of the present folder. Nothing leaves
    this machine, and nothing is fetched.

    Examples:

        racecraft lessons

        racecraft lessons --host 0.0.0.0 --no-open
    """
    from pathlib import Path

    from racecraft.cli.output import print_json, say
    from racecraft.console.workspace import Workspace
    from racecraft.lessons.service import make_lessons
    from racecraft.web.access import access_for
    from racecraft.web.browser import open_page
    from racecraft.web.ports import choose_port
    from racecraft.web.server import address_of, serve

    chosen, note = choose_port(port, PORT)
    if note:
        say(note, quiet_stdout=json)
    access = access_for(host)
    application = make_lessons(access, models=Workspace(Path()).newest_runs)

    def ready(port: int) -> None:
        address = address_of(host, port, access, "/lessons")
        print_json({"address": address}) if json else print(f"The lessons at {address}; Ctrl-C ends it")
        if open_it:
            open_page(address)

    serve(application, host, chosen, ready)
