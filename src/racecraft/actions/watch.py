"""Watch a run on a page of this machine, live and after it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from racecraft.actions.action import Served, action
from racecraft.actions.named_run import RUN_HELP, named_run
from racecraft.contract.progress import Progress, quiet
from racecraft.serving.served_run import LOOPBACK, PORT, serve_run
from racecraft.settings.request import Request, argument, option

HOST_HELP = "Listen address; 0.0.0.0: all interfaces, for who has the token of the address printed."


def port_help(port: int) -> str:
    """Return the help of a port that is chosen where none is given."""
    return f"By default {port} or, where it is taken, the next free; 0: any free one."


@dataclass(frozen=True, kw_only=True)
class WatchRequest(Request):
    """Which run is watched, and where its page is."""

    run: str = argument(
        f"{RUN_HELP} It may be training. A checkpoint: begin with what was driven then.", metavar="RUN[:which]"
    )
    port: int | None = option(None, port_help(PORT), low=0, high=65535)
    host: str = option(LOOPBACK, HOST_HELP)
    open_it: bool = option(True, "Open it in the browser.", "--open/--no-open")


@dataclass(frozen=True)
class WatchedRun(Served):
    """A run behind a page; it answers until it is closed."""

    run: Path
    url: str
    close: Callable[[], None]
    opens_page: bool

    def as_dictionary(self) -> dict[str, Any]:
        """Return its address and the run."""
        return {"url": self.url, "run": str(self.run)}

    def serve(self, ready: Callable[[], None], progress: Progress) -> None:
        """Show the address, open the page, and wait for Ctrl-C."""
        serve_page(self.url, self.close, ready, self.opens_page)


def serve_page(url: str, close: Callable[[], None], ready: Callable[[], None], opens: bool) -> None:
    """Keep a page that is served by a thread until Ctrl-C, then close it.

    Args:
        url: Its address.
        close: Ends it.
        ready: Shows the address.
        opens: Whether a browser is opened.
    """
    from racecraft.serving.interrupts import wait_for_interrupt
    from racecraft.web.browser import open_page

    try:
        with suppress(KeyboardInterrupt):
            ready()
            if opens:
                open_page(url)
            wait_for_interrupt()
    finally:
        close()


@action
def watch(request: WatchRequest, progress: Progress = quiet) -> WatchedRun:
    """Watch a run in the browser, while it trains or after; until Ctrl-C.

    Every car on the map with its camera, the curves beside; after the training every kept episode. A training that
    is not looked at writes nothing for this page.

    Examples:

        racecraft watch runs/reinvent_base-1

        racecraft watch runs/reinvent_base-1:laptime --port 9000

        racecraft watch runs/reinvent_base-1 --host 0.0.0.0

    Raises:
        RunFolderError: No run folder.
        PortError: The port cannot be listened on.
    """
    from racecraft.formats.checkpoint_ranking import find_checkpoint
    from racecraft.formats.run_folder import RunFolder

    run, which = named_run(request.run)
    at = "" if which is None else f"#iteration={find_checkpoint(RunFolder.open(run), which).iteration}"
    watched = serve_watched(run, request.port, progress, request.host, request.open_it)
    return replace(watched, url=watched.url + at)


def serve_watched(
    run: Path, port: int | None, progress: Callable[[str], None], host: str = LOOPBACK, opens: bool = False
) -> WatchedRun:
    """Begin to serve a run.

    Raises:
        RunFolderError: No run folder.
        PortError: The port cannot be listened on.
    """
    close, address = serve_run(run, port, progress, host)
    return WatchedRun(run, address, close, opens)
