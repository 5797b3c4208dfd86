"""A run behind a page of this machine. Begin with `serve_run`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

PORT = 8100
"""Where the original's viewer stood (facts: deepracer-systems.md A2, DR_WEBVIEWER_PORT)."""
LOOPBACK = "127.0.0.1"


def serve_run(
    run: Path, port: int | None, progress: Callable[[str], None], host: str = LOOPBACK
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

    server = WatchServer(RunFolder.open(run), access_for(host))
    chosen, note = choose_port(port, PORT)
    if note:
        progress(note)
    return server.close, server.start(chosen, host)
