"""`racecraft watch RUN`: a training on a page of this machine, live and after it."""

from __future__ import annotations

import os
import threading
import webbrowser
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from racecraft.actions.named_run import RUN_HELP, named_run
from racecraft.cli.options import Json

PORT = 8100
"""Where the original's viewer stood (facts: deepracer-systems.md A2, DR_WEBVIEWER_PORT)."""

BEHIND = 5
"""Niceness of whoever serves a page: a training comes first."""

Port = Annotated[
    int | None,
    typer.Option(min=0, max=65535, help=f"By default {PORT} or, where it is taken, the next free; 0: any free one."),
]
Host = Annotated[
    str, typer.Option(help="Listen address; 0.0.0.0: all interfaces, for who has the token of the address printed.")
]
LOOPBACK = "127.0.0.1"
Open = Annotated[bool, typer.Option("--open/--no-open", help="Open it in the browser.")]


def watch(
    run: Annotated[
        str,
        typer.Argument(
            metavar="RUN[:which]", help=f"{RUN_HELP} It may be training. A checkpoint: begin with what was driven then."
        ),
    ],
    port: Port = None,
    host: Host = LOOPBACK,
    open_it: Open = True,
    json: Json = False,
) -> None:
    """Watch a run in the browser, while it trains or after; until Ctrl-C.

    Every car on the map with its camera, the curves beside; after the training every kept episode. A training that
    is not looked at writes nothing for this page.

    Examples:

        racecraft watch runs/reinvent_base-1

        racecraft watch runs/reinvent_base-1:laptime --port 9000

        racecraft watch runs/reinvent_base-1 --host 0.0.0.0
    """
    watch_run(*named_run(run), port, open_it, json, host)


def watch_run(run: Path, which: str | None, port: int | None, open_it: bool, json: bool, host: str = LOOPBACK) -> None:
    """Serve a run until Ctrl-C; the page begins with the checkpoint that is named."""
    from racecraft.cli.output import print_json, say
    from racecraft.formats.checkpoint_ranking import find_checkpoint
    from racecraft.formats.run_folder import RunFolder
    from racecraft.serving.interrupts import wait_for_interrupt

    def tell(text: str) -> None:
        say(text, quiet_stdout=json)

    at = "" if which is None else f"#iteration={find_checkpoint(RunFolder.open(run), which).iteration}"
    close, address = serve(run, port, tell, host)
    address += at
    try:
        with suppress(KeyboardInterrupt):
            if json:
                print_json({"url": address, "run": str(run)})
            else:
                tell(f"{run}: {address}  (Ctrl-C ends)")
            if open_it:
                open_page(address)
            wait_for_interrupt()
    finally:
        close()


def open_page(address: str) -> None:
    """Open a page aside: a browser of the terminal keeps its caller waiting until it is closed."""
    threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()


def serve(
    run: Path, port: int | None, tell: Callable[[str], None], host: str = LOOPBACK
) -> tuple[Callable[[], None], str]:
    """Begin to serve a run; return what ends it, and the address, with a token where other machines may ask.

    Raises:
        RunFolderError: No run folder.
        PortError: The port asked for cannot be listened on.
    """
    from racecraft.formats.run_folder import RunFolder
    from racecraft.serving.watch_server import WatchServer
    from racecraft.web.access import access_for
    from racecraft.web.ports import choose_port

    if hasattr(os, "nice"):
        os.nice(BEHIND)
    server = WatchServer(RunFolder.open(run), access_for(host))
    chosen, note = choose_port(port, PORT)
    if note:
        tell(note)
    return server.close, server.start(chosen, host)
