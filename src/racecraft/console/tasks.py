"""Commands that a page asks for and that take longer than a page may wait: judging, explaining, exporting.

Begin with `Tasks.begin`. What a command makes lies in files, as always; a task that is lost with the console is
asked for again.
"""

from __future__ import annotations

import contextvars
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from racecraft.console.commands import run_command
from racecraft.contract.errors import RacecraftError

REMEMBERED = 100

Then = Callable[[dict[str, Any]], None]
"""Takes what a command told, in the task's own thread."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """A command at work, or how the last one ended."""

    what: str
    """In a person's words: "Evaluating"."""
    began: float
    """Seconds since 1970."""
    is_open: bool = True
    fault: str = ""
    """Why it could not be done; "": it was, or is not done yet."""


class Tasks:
    """What the console's pages asked for.

    Args:
        told: Called with the name of a model whose task began or ended, from any thread.
        workers: Threads that commands wait for; None: one of its own.
    """

    def __init__(
        self, on_change: Callable[[str], None] = lambda model: None, workers: ThreadPoolExecutor | None = None
    ) -> None:
        self._told, self._workers = on_change, workers or ThreadPoolExecutor(1)
        self._lock = threading.Lock()
        self._tasks: dict[str, Task] = {}

    def begin(
        self, model: str, what: str, words: Sequence[str], folder: Path, then: Then = lambda result: None
    ) -> None:
        """Begin a command, unless one of the same purpose works for this model already.

        Args:
            model: Whose pages tell of it.
            what: As `Task.what`.
            words: Behind `racecraft`.
            folder: Where it is typed.
            then: What is done with what it told.
        """
        key = f"{model} {what}"
        with self._lock:
            if key in self._tasks and self._tasks[key].is_open:
                return
            self._tasks[key] = Task(what=what, began=time.time())
            for old in list(self._tasks)[:-REMEMBERED]:
                del self._tasks[old]
        here = contextvars.copy_context()  # whose code is refused holds in the other thread as well
        self._workers.submit(here.run, self._work, model, key, words, folder, then)
        self._told(model)

    def of(self, model: str, what: str) -> dict[str, Any] | None:
        """Return a model's `Task` of a purpose as plain data; None where there is none or it was done."""
        task = self._tasks.get(f"{model} {what}")
        return asdict(task) if task is not None and (task.is_open or task.fault) else None

    def close(self) -> None:
        """Begin no other one; those at work end with their command."""
        self._workers.shutdown(wait=False, cancel_futures=True)

    def _work(self, model: str, key: str, words: Sequence[str], folder: Path, then: Then) -> None:
        fault = ""
        try:
            then(run_command(words, folder))
        except (RacecraftError, OSError) as error:
            fault = str(error)
        with self._lock:
            self._tasks[key] = replace(self._tasks[key], is_open=False, fault=fault)
        self._told(model)
