"""Before anything is imported: threads that wait shall soon sleep, as the command line has it (see `cli/app.py`).

Processes that tests spawn shall find `tests` too, be it `pytest` that was typed or `python -m pytest`.

And Ctrl-C shall reach the programs that tests start: a suite that a shell began in the background ignores it, and so
would they.

Networks of tests are small: on one thread they are faster than on two that wait for each other, and the same whichever
machine runs them. Each test begins with the processor as the first one found it, whatever trained or served before.

No test cuts the power: neither files nor databases are forced onto the disk, which takes milliseconds each time, twenty
times a training of two iterations.

PyTorch's twenty loggers pass nothing on, so that pytest gives its handlers to each and takes them away, six times a
test; here they pass on.

Servers look every 0.1 s whether they are to end, and wait as long again: here a tenth of it, two hundred times.

A million objects are made while tests are collected, and stay: the search for garbage leaves them out. What tests made
and kept is searched a fifth as often, since each search takes 0.2 s.

`--quick` leaves out the tests that `tests/slow.txt` names (see `scripts/list_slow_tests.py`).

Where no kernel is compiled yet, two workers would compile the same ones beside each other, for minutes:
`tests/first.txt` names the files that begin. Others follow in the order of their folders, so that short ones come last.
"""

import asyncio
import gc
import logging
import os
import signal
import sqlite3
import sys
from collections.abc import Generator
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

os.environ.setdefault("GOMP_SPINCOUNT", "2000")
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.fsync = lambda handle: None
gc.disable()
collect_ignore = ["src/racecraft/database/migrations/env.py"]
"""Alembic alone can run it."""
if (root := str(Path(__file__).parent)) not in sys.path:
    sys.path.insert(0, root)
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
_connect = sqlite3.connect


def _connect_unforced(*arguments: Any, **options: Any) -> sqlite3.Connection:
    """Open a database as ever, but for what a power cut would need."""
    database = _connect(*arguments, **options)
    with suppress(sqlite3.Error):  # of a file that is none, which the test is about
        database.execute("pragma synchronous=off")
    return database


sqlite3.connect = sqlite3.dbapi2.connect = _connect_unforced


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let `make quick` ask for the everyday loop."""
    parser.addoption("--quick", action="store_true", help="leave out the tests that tests/slow.txt names")


def pytest_configure(config: pytest.Config) -> None:
    """Keep our order of files where several workers share them; xdist's begins with those of most tests."""
    config.option.loadscopereorder = False


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> Generator[None, object, object]:
    """Search a file for examples in docstrings only where it holds one: most of two thousand hold none."""
    parent.config.option.doctestmodules = b">>>" in file_path.read_bytes()
    return (yield)


def pytest_pycollect_makeitem(collector: pytest.Collector, name: str) -> list[pytest.Item] | None:
    """Leave slow tests out where that was asked for, before their parameters are made."""
    is_left_out = collector.config.getoption("--quick") and f"{collector.nodeid}::{name}" in _listed("slow.txt")
    return [] if is_left_out else None


@cache
def _listed(name: str) -> dict[str, int]:
    """Return the lines of a list of tests and the place of each."""
    lines = (Path(__file__).parent / "tests" / name).read_text(encoding="utf-8").splitlines()
    return {line: place for place, line in enumerate(lines) if not line.startswith("#")}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put first what is to begin."""
    places = _listed("first.txt")
    items.sort(key=lambda item: places.get(item.nodeid.split("::")[0], len(places) + 1))


def pytest_collection_finish() -> None:
    """Search for garbage from now on, and only in what is made from now on; quicken loggers and servers."""
    gc.freeze()
    gc.set_threshold(*gc.get_threshold()[:2], 5 * gc.get_threshold()[2])
    gc.enable()
    for name, logger in logging.root.manager.loggerDict.items():
        if name.startswith("torch") and isinstance(logger, logging.Logger):
            logger.propagate = True
    if server := sys.modules.get("uvicorn.server"):
        server.asyncio = SimpleNamespace(**{**vars(asyncio), "sleep": lambda seconds: asyncio.sleep(seconds / 10)})


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(call: pytest.CallInfo[None]) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Show what browsers showed when a test failed: a selector that was waited for does not say what came instead."""
    report = yield
    if call.when == "call" and report.failed and (browser := sys.modules.get("tests.browser")):
        report.sections += browser.shown()
    return report


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol() -> Generator[None, object, object]:
    """Restore after each test what trainings and servers set up in their process."""
    interval = sys.getswitchinterval()
    done = yield
    sys.setswitchinterval(interval)
    if torch := sys.modules.get("torch"):
        torch.set_num_threads(int(os.environ["OMP_NUM_THREADS"]))
        torch.set_flush_denormal(False)
    if kernels := sys.modules.get("racecraft.kernels.compile"):
        kernels.set_threads(1)
    return done
