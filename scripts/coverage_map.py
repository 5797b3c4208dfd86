"""Which tests run which lines, and what each test costs: asked once a test file, kept until it or the package changes.

`coverage` writes down the lines by test. What a fixture runs is put to every test of its file, since only the first one
that wants it is seen to run it.
"""

from __future__ import annotations

import hashlib
import json
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import forks

WATCHED_SECONDS = 40
"""After so many processor seconds no further test of a file is watched; those that are left are not asked."""
LONGEST_SECONDS = 90
"""The processor seconds after which a test file is given up, and watched once more without `coverage`."""
LONGEST_TEST_SECONDS = 120
"""A test that takes longer, by the clock, is not asked either."""
LONGEST_WATCHED_TEST_SECONDS = 20
"""Processor seconds of one test after which `coverage` is thought to keep it from its end."""


class CoverageMap:
    """What was learnt of the test files of a project; `kept` is the folder that remembers it."""

    def __init__(self, root: Path, kept: Path, ready: Callable[[], None]) -> None:
        """Begin with what is kept; `ready` sets up a fork in which tests are to run."""
        self._root, self._kept, self._ready = root, kept, ready
        kept.mkdir(parents=True, exist_ok=True)
        sources = sorted((root / "src").rglob("*.py"))
        self._package = hashlib.sha256(b"\0".join(one.read_bytes() for one in sources)).hexdigest()
        self._stems: dict[str, Path] = {}
        self._read: dict[tuple[Path, str], dict[int, set[str]]] = {}
        self.costs: dict[str, float] = {}
        """The processor seconds of each test that passes, by its name for pytest."""

    def read(self, tests: list[Path]) -> None:
        """Learn what these test files run, those not yet known by running them."""
        for test in tests:
            name = test.relative_to(self._root).as_posix()
            if name in self._stems:
                continue
            known = hashlib.sha256(test.read_bytes() + self._package.encode()).hexdigest()[:16]
            stem = self._kept / f"{name.removesuffix('.py').replace('/', '-')}-{known}"
            costs = stem.with_suffix(".json")
            if not costs.exists():
                print(f"     what {name} runs …", flush=True)
                self._watch(name, stem)
            self.costs |= json.loads(costs.read_text())
            self._stems[name] = stem

    def running(self, path: Path, files: set[str], first: int = 1, last: int = 1 << 30) -> set[str]:
        """Return the tests of some files that run a line from `first` to `last` of a module.

        Args:
            path: The module, from the root of the repository.
            files: Test files, likewise; all were read. One whose lines could not be watched runs them all.
            first: A line, from 1.
            last: Another, this one included.
        """
        found: set[str] = set()
        for name in files:
            if not self._stems[name].with_suffix(".coverage").exists():
                found |= self._of(name)
            for line, tests in self._lines(path, name).items():
                if first <= line <= last:
                    found |= tests
        return found

    def _lines(self, path: Path, name: str) -> dict[int, set[str]]:
        """Return the tests of a file by the lines of a module that they run."""
        from coverage import CoverageData

        if (path, name) in self._read:
            return self._read[path, name]
        lines = self._read.setdefault((path, name), {})
        kept = self._stems[name].with_suffix(".coverage")
        of_file = self._of(name)
        if of_file and kept.exists():
            data: Any = CoverageData(kept)
            data.read()
            for line, contexts in data.contexts_by_lineno(str(self._root / path)).items():
                lines[line] = of_file if name in contexts else of_file.intersection(contexts)
            data.close()
        return lines

    def _of(self, name: str) -> set[str]:
        return {test for test in self.costs if test.startswith(f"{name}::")}

    def _watch(self, name: str, stem: Path, lines: bool = True) -> None:
        """Run a test file and keep what its tests cost, and which lines they run."""

        def act() -> int:
            import coverage
            import pytest

            self._ready()
            watch = coverage.Coverage(
                stem.with_suffix(".coverage"), include=[f"{self._root}/src/*"], config_file=False, messages=False
            )
            witness = Witness(watch if lines else None)
            if lines:
                watch.start()
            longest = f"-otimeout={LONGEST_TEST_SECONDS}"
            code = pytest.main(
                ["-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--tb=short", longest, name], plugins=[witness]
            )
            if lines:
                watch.stop()
                watch.save()
            stem.with_suffix(".json").write_text(json.dumps(witness.costs))
            return 0 if code in (0, 1, 5) or witness.stopped else code

        said = stem.with_suffix(".log")
        code = forks.in_fork(act, self._root, said, LONGEST_SECONDS)
        if code is None:
            stem.with_suffix(".coverage").unlink(missing_ok=True)
            stem.with_suffix(".json").write_text("{}")
            if lines:  # CPython 3.11 does not bear a thread's exception in a function that is traced
                print(f"     {name}: no end; once more, without its lines", flush=True)
                self._watch(name, stem, lines=False)
            else:
                print(f"     {name}: no end; its tests are not asked", flush=True)
        elif code:
            stem.with_suffix(".json").unlink(missing_ok=True)
            raise SystemExit(f"{name} could not be run; {said} tells why")


class Witness:
    """A plugin that names the context of what runs, and keeps what each test that passes costs."""

    def __init__(self, watch: Any) -> None:
        """Take the coverage that is measured; None measures none."""
        self._watch = watch
        self._session: Any = None
        self._started = time.process_time()
        self.stopped = False
        self._began = 0.0
        self._unfit: set[str] = set()
        self.costs: dict[str, float] = {}

    def pytest_sessionstart(self, session: Any) -> None:
        """Know whom to stop."""
        self._session = session

    def pytest_runtest_setup(self, item: Any) -> None:
        """Put what fixtures run to the file."""
        self._began = time.process_time()
        self._put_to(item.nodeid.split("::")[0])

    def pytest_runtest_call(self, item: Any) -> None:
        """Put what the test runs to the test."""
        self._put_to(item.nodeid)

    def _put_to(self, context: str) -> None:
        if self._watch is not None:
            self._watch.switch_context(context)
            signal.setitimer(signal.ITIMER_VIRTUAL, LONGEST_WATCHED_TEST_SECONDS)  # ends the process; nobody handles it

    def pytest_runtest_logfinish(self) -> None:
        """Stop where the file has cost enough."""
        if time.process_time() - self._started > WATCHED_SECONDS and self._session:
            self.stopped = True
            self._session.shouldstop = f"watched for {WATCHED_SECONDS} s"

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Keep the cost of what passed in all three parts, and forget the test that did not."""
        if report.when == "call" and report.passed and report.nodeid not in self._unfit:
            self.costs[report.nodeid] = round(time.process_time() - self._began, 3)
        elif not report.passed:
            self._unfit.add(report.nodeid)
            self.costs.pop(report.nodeid, None)
