"""One process beside the console for what needs heavy packages and an answer at once: checking a reward as one types.

Begin with `Helper.ask`.
"""

from __future__ import annotations

import multiprocessing
import pkgutil
import threading
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from racecraft.cluster.deadlines import load_scaled
from racecraft.contract.errors import SettingError

PATIENCE_SECONDS = 60.0


class Helper:
    """A process that starts with the first question, keeps what it has imported, and is started again if it ends."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._pool: ProcessPoolExecutor | None = None

    def ask(self, function: str, *arguments: Any) -> Any:
        """Return what a function returns in the other process; its errors are raised here.

        Args:
            function: As "package.module:name".
            arguments: Plain values.

        Raises:
            SettingError: The process ended, or took longer than PATIENCE_SECONDS; a crowded machine is given more.
        """
        pool, seconds = self._opened(), load_scaled(PATIENCE_SECONDS)
        try:
            return pool.submit(_call, function, *arguments).result(seconds)
        except (BrokenProcessPool, TimeoutError):
            self.close()
            raise SettingError(
                "The process that looks at it ended or took longer than {seconds:g} s; expected an answer.",
                seconds=seconds,
            ) from None

    def close(self) -> None:
        """End the process; the next question starts another."""
        with self._lock:
            pool, self._pool = self._pool, None
        if pool is not None:
            for process in list((pool._processes or {}).values()):
                process.terminate()
            pool.shutdown(wait=False, cancel_futures=True)

    def _opened(self) -> ProcessPoolExecutor:
        with self._lock:
            if self._pool is None:
                self._pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
            return self._pool


def _call(function: str, *arguments: Any) -> Any:
    return pkgutil.resolve_name(function)(*arguments)
