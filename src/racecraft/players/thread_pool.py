"""Threads that are waited for only so long. Code that hangs cannot be stopped in Python; it can be left behind.

A `ThreadPool` works off tasks in daemon threads. A task that was given up with `leave_behind` keeps its thread busy
until it ends by itself; a fresh thread takes its place, up to a number, so that a few hanging calls do not stop the
rest.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

MAX_LEFT_BEHIND = 64


class ThreadPool:
    """Some threads and a queue of tasks.

    Args:
        size: Tasks worked on at the same time.
    """

    def __init__(self, size: int = 1) -> None:
        self.size = size
        self._tasks: queue.SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._threads = 0
        self._behind: set[Future[Any]] = set()

    @property
    def left_behind(self) -> int:
        """Tasks that were given up and still run."""
        return len(self._behind)

    def submit(self, act: Callable[[], Any]) -> Future[Any]:
        """Return a future of what `act` returns or raises."""
        future: Future[Any] = Future()
        with self._lock:
            if self._threads < self.size:
                self._begin_thread()
        self._tasks.put((future, act))
        return future

    def leave_behind(self, future: Future[Any]) -> None:
        """Give up a task: one that has not begun never will, one that runs gets a substitute thread."""
        if future.cancel():
            return
        with self._lock:
            if not future.done() and future not in self._behind and len(self._behind) < MAX_LEFT_BEHIND:
                self._behind.add(future)
                self._begin_thread()

    def close(self) -> None:
        """Let the threads go home when their tasks are done; nothing is waited for."""
        with self._lock:
            for _ in range(self._threads):
                self._tasks.put(None)

    def _begin_thread(self) -> None:
        self._threads += 1
        threading.Thread(target=self._work, name="racecraft-worker", daemon=True).start()

    def _work(self) -> None:
        while (task := self._tasks.get()) is not None:
            future, act = task
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(act())
            except Exception as error:
                future.set_exception(error)
            except BaseException as error:  # a player may ask the whole program to stop; that is not its to decide
                future.set_exception(RuntimeError(f"{type(error).__name__}: {error}"))
            with self._lock:
                if future in self._behind:
                    self._behind.remove(future)
                    self._threads -= 1
                    return
        with self._lock:
            self._threads -= 1
