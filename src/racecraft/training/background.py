"""Write files beside the training: one patient thread, one job after the other.

Putting a file safely on the disk takes some ten milliseconds of waiting, during which the training can go on. What
waits here is not on the disk yet; `Background.call_done` tells what has arrived, and raises what went wrong.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

Done = Callable[[], None]


class Gate:
    """Holds jobs until there is a core for them; whoever waits for a job opens it.

    Args:
        seconds: How long it holds at most, from each `close` on.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds, self._until = seconds, 0.0
        self._opened = threading.Event()

    def close(self) -> None:
        """Hold what comes."""
        self._until = time.monotonic() + self._seconds
        self._opened.clear()

    def open(self) -> None:
        """Hold nothing."""
        self._opened.set()

    def wait(self) -> None:
        """Wait until it is open, or has been closed for long enough."""
        self._opened.wait(max(0.0, self._until - time.monotonic()))


class Background:
    """Jobs in the order in which they were given.

    Args:
        patience: With so many jobs waiting, `give` waits for the oldest: a slow disk slows the training down.

    Attributes:
        gate: Every job passes it; None: there is none.
    """

    def __init__(self, patience: int = 16) -> None:
        self._patience = patience
        self.gate: Gate | None = None
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="racecraft-files")
        self._waiting: deque[tuple[Future[None], Done]] = deque()

    def give(self, job: Callable[[], None], done: Done) -> None:
        """Have a job done soon; `done` is called by a later `call_done`, in the caller's own thread.

        Raises:
            OutputFileError: An earlier job failed.
        """
        self._waiting.append((self._thread.submit(self._in_its_time, job), done))
        while len(self._waiting) > self._patience:
            self._hurry()
            self._take()

    def call_done(self, *, wait: bool = False) -> None:
        """Call `done` for every job that was done, or with `wait` for all of them.

        Raises:
            OutputFileError: A job failed: the disk is full, or the place cannot be written.
        """
        if wait:
            self._hurry()
        while self._waiting and (wait or self._waiting[0][0].done()):
            self._take()

    def close(self) -> None:
        """Do what waits, and end the thread. Doing so twice is doing so once."""
        try:
            self.call_done(wait=True)
        finally:
            self._thread.shutdown()

    def _in_its_time(self, job: Callable[[], None]) -> None:
        if self.gate is not None:
            self.gate.wait()
        job()

    def _hurry(self) -> None:
        if self.gate is not None:
            self.gate.open()

    def _take(self) -> None:
        future, done = self._waiting.popleft()
        future.result()
        done()
