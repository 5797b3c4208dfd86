"""Let Python run the kernels as they are written, so that a changed one is asked without being compiled.

Three things separate the two. A record's fields are attributes to Numba alone, so arrays of records are handed over as
`numpy.recarray`. Numbers of few bits become wide ones as soon as Numba reckons with them, so other arrays are handed
over as `Widening`. Whole numbers of 64 bits wrap round without a word. Where Python reckons otherwise all the same, a
test may fail that passes compiled: it then fails without the mutant too, and is no judge.
Pictures take Python seconds, so that tests which want many of them are left out (`Hurry`).
"""

from __future__ import annotations

import functools
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

LONGEST_TEST_SECONDS = 3
"""The processor seconds after which a test is skipped."""

_within = threading.local()


def interpret() -> None:
    """Make decorators of kernels hand functions back as they are; call it before any kernel is imported."""
    from racecraft.kernels import compile as kernels

    kernels.compiled = _left_alone


def _left_alone(function: Callable[..., Any], **_options: Any) -> Callable[..., Any]:
    @functools.wraps(function)
    def entered(*arrays: Any) -> Any:
        if getattr(_within, "kernel", False):
            return function(*arrays)
        _within.kernel = True
        try:
            with np.errstate(all="ignore"):
                return function(*(_as_numba_reads(one) for one in arrays))
        finally:
            _within.kernel = False

    vars(entered)["py_func"] = function  # as a compiled one has it
    return entered


class Widening(np.ndarray[Any, Any]):
    """An array whose single numbers are Python's; but float64 goes on to divide by zero, and uint64 to wrap round."""

    def __getitem__(self, at: Any) -> Any:
        """Return a number, or a part of the array."""
        got = super().__getitem__(at)
        return got if isinstance(got, np.ndarray | np.float64 | np.uint64) else got.item()


def _as_numba_reads(argument: Any) -> Any:
    """Return an argument whose arrays, its own or a tuple's, are read as Numba reads them."""
    if isinstance(argument, np.ndarray):
        return argument.view(np.recarray if argument.dtype.names else Widening)
    if isinstance(argument, np.void) and argument.dtype.names:
        return np.asarray(argument).view(np.recarray)[()]
    if isinstance(argument, tuple):
        inner = [_as_numba_reads(one) for one in argument]
        return type(argument)(*inner) if hasattr(argument, "_fields") else tuple(inner)
    return argument


class Hurry:
    """A plugin of pytest that skips what takes too long, and leaves it out from then on; `kept` names those."""

    def __init__(self, kept: Path) -> None:
        """Read who took too long before."""
        self._kept = kept
        self._known = set(kept.read_text().splitlines()) if kept.exists() else set()

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        """Leave out who is known."""
        items[:] = [one for one in items if one.nodeid not in self._known]

    def pytest_runtest_setup(self, item: Any) -> None:
        """Begin to count."""

        def skip(*_: Any) -> None:
            import pytest

            self.leave_out(item.nodeid)
            pytest.skip("too long without being compiled")

        signal.signal(signal.SIGVTALRM, skip)
        signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST_TEST_SECONDS)

    def leave_out(self, test: str) -> None:
        """Leave a test out from now on."""
        with self._kept.open("a") as file:
            file.write(f"{test}\n")

    def pytest_runtest_teardown(self) -> None:
        """Leave it the time to tidy up."""
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
