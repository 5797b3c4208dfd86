"""A page beside a training: `racecraft train --watch`. Begin with `WatchProcess`.

The page is served by a process of its own, which meets the training in the run folder only and takes its turn behind
it. It ends with the training's process, whatever becomes of that.
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.serving.served_run import PORT, serve_run
from racecraft.web.browser import open_page

if TYPE_CHECKING:
    from racecraft.contract.progress import Progress

LOOK_S = 0.2


class WatchProcess:
    """Starts a process that serves the page as soon as the run folder stands; it is a callback of the training.

    Args:
        progress: Receives the address.

    Raises:
        PortError: None of the usual ports is free.
    """

    def __init__(self, progress: Callable[[str], None]) -> None:
        from racecraft.web.ports import choose_port

        self._port, note = choose_port(None, PORT)
        if note:
            progress(note)
        self._progress = progress
        self._process: subprocess.Popen[bytes] | None = None

    def run_made(self, path: Path) -> None:
        """Serve the run; the process lives as long as its standard input is open, and is not hit by our Ctrl-C."""
        command = [sys.executable, "-m", __name__, str(path), str(self._port)]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        self._progress(f"watch: http://127.0.0.1:{self._port}/")

    def serve(self, ready: Callable[[], None], progress: Progress) -> None:
        """Call `ready`; before a person keep the page until Ctrl-C; close it."""
        try:
            ready()
            if progress.is_before_person:
                progress("\nThe page stays until Ctrl-C.")
                with contextlib.suppress(KeyboardInterrupt):
                    self.wait()
        finally:
            self.close()

    def wait(self) -> None:
        """Wait until the page is gone, in short waits: a Ctrl-C just before a wait without end would be lost."""
        while self._process is not None and self._process.poll() is None:
            time.sleep(LOOK_S)

    def close(self) -> None:
        """End the page. Doing so twice is doing so once."""
        if self._process is None:
            return
        assert self._process.stdin is not None
        self._process.stdin.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(5.0)
        self._process.kill()

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Nothing to do: the page looks for itself."""

    def iteration(self, report: object) -> None:
        """Nothing to do."""

    def end(self, reason: str) -> None:
        """Nothing to do."""


def main() -> None:
    """Serve the run and the port that the command line names until standard input ends."""
    run, port = sys.argv[1:]
    close, address = serve_run(Path(run), int(port), lambda text: None)
    open_page(address)
    sys.stdin.buffer.read()
    close()


if __name__ == "__main__":
    main()
