"""One thread that keeps the index current, and tells who listens. Begin with `Watcher`."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable

from racecraft.console.index import Index
from racecraft.contract.errors import RacecraftError
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.states import State

LOOK_SECONDS = 1.0
"""How often it looks while looking takes little."""
SHARE = 0.05
"""The most of a core that looking may take: it rests so much longer where looking takes long."""


class Watcher:
    """Refreshes the index until it is closed.

    Args:
        index: What it keeps current.
        home: Where the jobs of this account are.
        told: Called with the names of the models that changed, in the watcher's thread; with none where only a job
            moved that trains no model, such as an endpoint.
    """

    def __init__(
        self, index: Index, home: JobPaths, on_change: Callable[[list[str]], None] = lambda names: None
    ) -> None:
        self._index, self._home, self.told = index, home, on_change
        self._wanted, self._closed = threading.Event(), threading.Event()
        self._one_at_a_time = threading.Lock()
        self._states: dict[str, State] = {}
        self._thread = threading.Thread(target=self._run, name="racecraft-console-watcher", daemon=True)
        self.fault = ""
        """Why the rows may be old; "": they are not."""

    def start(self) -> None:
        """Look in a thread, again and again; where the index is empty, once before."""
        if not self._index.is_filled:
            self.refresh()
        self._thread.start()

    def close(self) -> None:
        """Stop; closing twice is closing once."""
        self._closed.set()
        self._wanted.set()
        if self._thread.is_alive():
            self._thread.join()

    def refresh(self) -> list[str]:
        """Refresh the index now; return the names of the models that changed."""
        with self._one_at_a_time:
            try:
                jobs = self._home.store().jobs()
                changed = self._index.refresh(jobs)
                self.fault = ""
            except RacecraftError as error:
                self.fault = str(error)
                return []
            before, self._states = self._states, {job.name: job.state for job in jobs}
        if changed or before != self._states:
            self.told(changed)
        return changed

    def _run(self) -> None:
        while not self._closed.is_set():
            began = time.monotonic()
            with contextlib.suppress(OSError):  # a folder that vanished while it was looked at
                self.refresh()
            took = time.monotonic() - began
            self._wanted.wait(max(LOOK_SECONDS, took / SHARE - took))
            self._wanted.clear()
