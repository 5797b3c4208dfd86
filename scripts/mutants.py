"""Break the code on purpose, one small thing at a time, and see whether the tests notice. Survivors are printed.

    python scripts/mutants.py                          30 mutants, seed 1
    python scripts/mutants.py --count 300 --seed 2     another sample
    python scripts/mutants.py --count 300 --minutes 5  so long; the next call goes on where this one ended
    python scripts/mutants.py --count 300 --in rollout formats     of some rooms only
    python scripts/mutants.py --only 17 203 --tests tests/training     two of them again, with other tests

A mutant is one change in one file: a comparison or a sum turned round, a constant moved, a condition negated, a
statement left out. It is tried in a copy of the house that is kept in build/mutants, with its compiled kernels. A map
made once by `coverage` (pip install coverage) says which tests run the line; those in files that name the module are
asked first, then the cheaper before the dearer, for as long as `BUDGET_SECONDS`, up to the first that fails. That one
is asked again without the mutant, and where it fails there as well, it is no judge. Lines that run at import, or in a
compiled kernel, no test is seen to run: there the tests of the module are asked, or of whoever imports it. Each mutant
lives in a fork of one process that has imported the large guests, and of kernels only those are compiled again that
read what was changed.

docs/decisions/0009-mutants.md says why this is a script of ours, and which survivors were read.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import importlib.util
import json
import os
import random
import re
import shutil
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import forks
from coverage_map import CoverageMap
from mutations import Mutant, changed, mutants_in

ROOT = Path(__file__).resolve().parents[1]
HOUSE = Path("src/racecraft")
ROOMS = ("contract", "envs", "algorithms", "rollout", "evaluation", "formats")
BUDGET_SECONDS = 60
"""What the tests that are asked about one mutant may cost together, in processor seconds without it."""
PATIENCE = 4
"""Tests may take so many times as long as without the mutant; `COMPILING` comes on top."""
COMPILING = {False: 20, True: 240}
"""The processor seconds that imports take, and the kernels that were changed."""


def main(words: list[str]) -> int:
    """Try a sample; 0 where at least 85 % were noticed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--in", dest="rooms", nargs="+", default=ROOMS, metavar="ROOM", help=", ".join(ROOMS))
    parser.add_argument("--minutes", type=float, default=1e9, help="no further one is begun after so long")
    parser.add_argument("--only", type=int, nargs="+", metavar="NUMBER", help="these of the sample, tried or not")
    parser.add_argument("--tests", type=Path, nargs="+", help="folders or files; those of the rooms")
    asked = parser.parse_args(words)
    if importlib.util.find_spec("coverage") is None:
        parser.error("the map of what each test runs is made by coverage, which is not installed: pip install coverage")
    every = [mutant for room in asked.rooms for mutant in mutants_in(HOUSE / room, ROOT)]
    if not every:
        parser.error(f"there is nothing to change in {', '.join(asked.rooms)}")
    sample = dict(enumerate(random.Random(asked.seed).sample(every, min(asked.count, len(every))), 1))
    print(f"{len(sample)} of {len(every):,} mutants, seed {asked.seed}", flush=True)
    ends = time.monotonic() + 60 * asked.minutes
    copy = Copy(ROOT / "build" / "mutants")
    tests = asked.tests or [*(Path("tests", room) for room in asked.rooms), *(HOUSE / room for room in asked.rooms)]
    if not copy.map.read(copy.test_files(tests), ends):
        print("the map is not whole yet; call again")
        return 2
    told = Told(copy.place / f"told-{asked.seed}-{'-'.join(asked.rooms)}-{asked.count}.json")
    again = asked.only or [number for number, one in sample.items() if told.unread(number, one)]
    for number in sorted(again, key=lambda one: (bool(copy.read_by(sample[one].path)), one)):
        if time.monotonic() > ends:
            break
        mutant = sample[number]
        noticed_by = copy.noticed(mutant)
        told.keep(number, mutant, noticed_by)
        print(f"{number:4} {noticed_by or 'SURVIVES'}\n     {mutant.path}:{mutant.line}  {mutant.what}", flush=True)
    return told.summary()


class Told:
    """What came of each mutant of a sample, on the disk, so that a sample can be tried in slices."""

    def __init__(self, path: Path) -> None:
        """Go on with what the file holds."""
        self._path = path
        self._all: dict[str, list[str]] = json.loads(path.read_text()) if path.exists() else {}

    def unread(self, number: int, mutant: Mutant) -> bool:
        """Tell whether this very mutant was not tried before."""
        return self._all.get(str(number), [""])[0] != f"{mutant.path}:{mutant.line}  {mutant.what}"

    def keep(self, number: int, mutant: Mutant, noticed_by: str) -> None:
        """Keep what came of one."""
        self._all[str(number)] = [f"{mutant.path}:{mutant.line}  {mutant.what}", noticed_by]
        self._path.write_text(json.dumps(self._all, indent=1))

    def summary(self) -> int:
        """Print how many were noticed and who lived; 0 where at least 85 % were noticed."""
        lived = {number: one for number, (one, noticed_by) in self._all.items() if not noticed_by}
        dead = len(self._all) - len(lived)
        print(f"\n{dead} of {len(self._all)} were noticed ({100 * dead / max(1, len(self._all)):.0f} %); survivors:")
        print("\n".join(f"{number:>6}  {one}" for number, one in lived.items()) or "  none")
        return int(dead < 0.85 * len(self._all))


class Copy:
    """A copy of the house in which mutants live, one at a time."""

    def __init__(self, place: Path) -> None:
        """Bring the copy in a folder up to date, and the map of its tests."""
        self.place, self._root = place.resolve(), place.resolve() / "house"
        place.mkdir(parents=True, exist_ok=True)
        _mirror(ROOT, self._root)
        if (ROOT.parent / "shared").exists() and not (place / "shared").exists():
            (place / "shared").symlink_to((ROOT.parent / "shared").resolve())
        self._compiled, self._tried = self.place / "compiled", self.place / "compiled-with-mutant"
        sys.path.insert(0, str(self._root / "src"))
        os.environ |= {"PYTHONPATH": str(self._root / "src"), "PYTHONDONTWRITEBYTECODE": "1"}
        forks.warm_up()
        self._reads = self._read_by_kernels()
        self.map = CoverageMap(self._root, self.place / "map", functools.partial(_keep_kernels_in, self._compiled))

    def test_files(self, places: list[Path]) -> list[Path]:
        """Return the test files of some places, and the modules there that hold examples."""
        found: list[Path] = []
        for place in places:
            files = [self._root / place] if place.suffix else sorted((self._root / place).rglob("*.py"))
            tests = place.parts[0] == "tests"
            found += [
                one for one in files if (one.name.startswith("test_") if tests else ">>> " in one.read_text("utf-8"))
            ]
        return found

    def read_by(self, path: Path) -> list[Path]:
        """Return the kernels that a file's numbers and functions are compiled into, itself among them."""
        return [kernel for kernel, read in self._reads.items() if self._root / path in read]

    def noticed(self, mutant: Mutant) -> str:
        """Return which test noticed a mutant, "late" with a name where tests came to no end; "" for nobody."""
        tests = self._chosen(mutant)
        while tests:
            allowed = PATIENCE * sum(self.map.costs[one] for one in tests) + COMPILING[bool(self.read_by(mutant.path))]
            with self._living(mutant):
                code, said = self._run(tests, allowed, self._tried)
            if code == 0:
                return ""
            noticing = re.findall(r"^(?:FAILED|ERROR) (\S+::.+?)(?: - .*)?$", said, re.MULTILINE)
            judge = next((one for one in noticing if one in self.map.costs), tests[0])
            if self._run([judge], PATIENCE * self.map.costs[judge] + COMPILING[True], self._compiled)[0] == 0:
                return f"late: {judge}" if code is None else judge
            tests = [one for one in tests if one != judge]
        return ""

    def _chosen(self, mutant: Mutant) -> list[str]:
        """Return the tests to ask, in order: those near before others, the cheap before the dear."""
        path, name = mutant.path, ".".join(mutant.path.with_suffix("").parts[1:]).removesuffix(".__init__")
        tests = self.map.running(path, mutant.line, mutant.last_line) or self.map.running(path, 1, 1 << 30)
        if not tests:
            compiled = [_name(kernel) for kernel in self.read_by(path)]
            users = {user for one in (name, *compiled) for user in self._importing(one)}
            tests = set().union(*(self.map.running(user, 1, 1 << 30) for user in users))
        imports, last = _imports(name), name.rpartition(".")[2]

        @functools.cache
        def near(file: str) -> bool:
            return bool(imports.search((self._root / file).read_text("utf-8"))) or Path(file).name == f"test_{last}.py"

        if not tests:
            tests = {one for one in self.map.costs if near(one.split("::")[0])}
        asked: list[str] = []
        cost = 0.0
        for test in sorted(tests, key=lambda one: (not near(one.split("::")[0]), self.map.costs[one], one)):
            cost += self.map.costs[test]
            if asked and cost > BUDGET_SECONDS:
                break
            asked.append(test)
        return asked

    def _importing(self, name: str) -> list[Path]:
        """Return the modules of the package that import a module, from the root of the repository."""
        imports = _imports(name)
        every = (self._root / HOUSE).rglob("*.py")
        return [one.relative_to(self._root) for one in every if imports.search(one.read_text("utf-8"))]

    def _run(self, tests: list[str], cpu_seconds: float, compiled: Path) -> tuple[int | None, str]:
        """Ask tests; return pytest's exit status, None where they were late, and what was said."""
        log = self.place / "said.log"

        def act() -> int:
            import pytest

            _keep_kernels_in(compiled)
            options = ("-q", "-x", "-rfE", "--tb=line", "-p", "no:cacheprovider", "-p", "no:xdist", "-o", "timeout=300")
            return int(pytest.main([*options, *tests]))

        code = forks.in_fork(act, self._root, log, cpu_seconds)
        return code, log.read_text(errors="replace")

    @contextlib.contextmanager
    def _living(self, mutant: Mutant) -> Iterator[None]:
        """Put a mutant into the house for a while, with compiled kernels that know nothing of what it changes."""
        path = self._root / mutant.path
        source, told = path.read_text(encoding="utf-8"), path.stat()
        self._compiled.mkdir(exist_ok=True)
        shutil.rmtree(self._tried, ignore_errors=True)
        shutil.copytree(self._compiled, self._tried, copy_function=os.link)
        for kernel in self.read_by(mutant.path):
            for one in self._tried.glob(f"*/{kernel.stem}.*"):
                one.unlink()
        path.write_text(changed(source, mutant.number), encoding="utf-8")
        try:
            yield
        finally:
            path.write_text(source, encoding="utf-8")
            os.utime(path, ns=(told.st_atime_ns, told.st_mtime_ns))  # by which Numba knows what it compiled

    def _read_by_kernels(self) -> dict[Path, set[Path]]:
        from racecraft.kernels import compile as kernels

        package = self._root / HOUSE
        return {path: set(kernels.read_by(path, package)) for path in package.rglob("kernels/*.py")}


def _name(path: Path) -> str:
    return ".".join(path.with_suffix("").parts[path.parts.index("racecraft") :])


def _imports(name: str) -> re.Pattern[str]:
    """Return how a module is called by whoever imports it."""
    parent, _, last = (re.escape(part) for part in name.rpartition("."))
    return re.compile(rf"{re.escape(name)}\b|from {parent} import [^\n]*\b{last}\b")


def _keep_kernels_in(folder: Path) -> None:
    import numba

    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    numba.config.CACHE_DIR = str(folder)


def _mirror(source: Path, target: Path) -> None:
    """Make a folder the same as another, times and all, and touch nothing in it that is the same already."""
    leave = shutil.ignore_patterns(
        ".git", ".venv*", "runs", "out", "__pycache__", ".*_cache", ".hypothesis", "shared", "site", "build"
    )

    def copied(one: str, other: str) -> None:
        if not os.path.exists(other) or Path(one).read_bytes() != Path(other).read_bytes():
            shutil.copy2(one, other)

    shutil.copytree(source, target, ignore=leave, copy_function=copied, dirs_exist_ok=True)
    for one in [*target.rglob("*.py")]:
        if not (source / one.relative_to(target)).exists():
            one.unlink()


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
