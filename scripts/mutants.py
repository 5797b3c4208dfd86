"""Break the code on purpose, one small thing at a time, and see whether the tests notice. Survivors are printed.

    python scripts/mutants.py                          30 mutants, seed 1
    python scripts/mutants.py --count 300 --seed 2     another sample
    python scripts/mutants.py --count 300 --minutes 5  stop after five minutes; the next call continues
    python scripts/mutants.py --count 300 --in rollout worlds/unity/env    of these packages only
    python scripts/mutants.py --in algorithms/sac.py --near --unmapped     of one file
    python scripts/mutants.py --count 300 --near --unmapped      a quick sieve, whose survivors are then asked again
    python scripts/mutants.py --only 17 203 --tests tests/training     of these two, survivors only, with other tests

A mutant is one change in one file: a comparison or a sum turned round, a constant moved, a condition negated, a
statement left out. It is tried in a copy of the project, kept in build/mutants with its compiled kernels. A map by
`coverage` says which tests run the line; it is made of each test file once, when that file is first asked. Files that
name the module are asked before the others of its package, cheap tests before dear ones, for as long as
`BUDGET_SECONDS`, up to the first that fails. That one is asked again without the mutant, and does not count if it fails
there as well. Lines that run at import, or in a compiled kernel, no test is seen to run: there all tests are asked that
run the module or what imports it. Each mutant lives in a fork of one process that has imported the heavy packages, and
only those kernels are compiled again that read what was changed: a car's take a minute or two, so they come last. With
--unmapped nothing is compiled: Python runs the kernels as they are written (`interpreted.py`).

docs/decisions/0009-mutants.md says why this is a script of ours, and which survivors were read.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
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
from interpreted import Hurry, interpret
from mutations import Mutant, changed, mutants_in

ROOT = Path(__file__).resolve().parents[1]
SOURCES = Path("src/racecraft")
PACKAGES = (
    "contract",
    "worlds/deepracer/env",
    "worlds/battlesnake/env",
    "worlds/unity/env",
    "worlds/gymnasium/env",
    "algorithms",
    "rollout",
    "evaluation",
    "formats",
)
ENOUGH = 0.8
"""The share of mutants that the tests have to notice."""
SETTINGS = re.compile(r"^class \w+Config\b", re.MULTILINE)
SETTINGS_PAGE = "tests/docs/test_docs.py::test_generated_pages_are_current"
"""What defines a group of settings; the test that compares their defaults with the page that shows them."""
SIEVE_SECONDS, SIEVE_FILES = 12, 4
"""Processor seconds and test files for a mutant without a map; one that is not noticed by then counts as alive."""
INTERPRETED_SECONDS = 30
"""The same where Python runs the kernels; compiled, they would take a minute or two before the first test."""
BUDGET_SECONDS = 60
"""What the tests of one mutant may cost together, in processor seconds without it."""
SLOWER = 4
"""How many times as long tests may take as without the mutant; `COMPILING` comes on top."""
COMPILING = {False: 20, True: 240}
"""The processor seconds that imports take, and the kernels that were changed."""


def main(args: list[str]) -> int:
    """Try a sample; return 0 where enough were noticed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--in",
        dest="packages",
        nargs="+",
        default=PACKAGES,
        metavar="PACKAGE",
        help=f"packages or files below {SOURCES.as_posix()} [default: {' '.join(PACKAGES)}]",
    )
    parser.add_argument("--minutes", type=float, default=1e9, help="start no further mutant after this time")
    parser.add_argument("--only", type=int, nargs="+", metavar="NUMBER", help="these of the sample only")
    parser.add_argument("--tests", type=Path, nargs="+", help="ask these folders or files about survivors")
    parser.add_argument("--near", action="store_true", help="ask only tests that name the module; a quick sieve")
    parser.add_argument("--unmapped", action="store_true", help="with --near: without a map; quicker still")
    asked = parser.parse_args(args)
    missing = [one for one in asked.packages if not (ROOT / SOURCES / one).exists()]
    if missing:
        parser.error(f"{', '.join(missing)}: not found below {SOURCES.as_posix()}; expected packages or files there")
    every = [mutant for package in asked.packages for mutant in mutants_in(SOURCES / package, ROOT)]
    if not every:
        parser.error(f"there is nothing to change in {', '.join(asked.packages)}")
    sample = dict(enumerate(random.Random(asked.seed).sample(every, min(asked.count, len(every))), 1))
    print(f"{len(sample)} of {len(every):,} mutants, seed {asked.seed}", flush=True)
    ends = time.monotonic() + 60 * asked.minutes
    copy = Copy(ROOT / "build" / "mutants")
    tests = asked.tests or [*(SOURCES / one for one in asked.packages), *map(_tests_of, asked.packages)]
    files = copy.test_files(tests)
    packages = "-".join(asked.packages).replace("/", ".")
    results = Results(copy.place / f"results-{asked.seed}-{packages}-{asked.count}.json")
    again = [
        number
        for number in asked.only or sample
        if (
            results.lives(number)
            if asked.tests
            else results.untried(number, sample[number], asked.near or asked.unmapped)
        )
    ]
    for number in sorted(again, key=lambda one: (bool(copy.read_by(sample[one].path)), one)):
        if time.monotonic() > ends:
            break
        mutant = sample[number]
        noticed_by = copy.sieved(mutant, files) if asked.unmapped else copy.noticed(mutant, files, asked.near)
        results.keep(number, mutant, noticed_by, asked.near or asked.unmapped)
        print(f"{number:4} {noticed_by or 'SURVIVES'}\n     {mutant.path}:{mutant.line}  {mutant.what}", flush=True)
    return results.summary()


def _tests_of(package: str) -> Path:
    """Return the folder of tests that mirrors a package, or a file's own, or the nearest above it."""
    folder = Path("tests", package)
    return next(one for one in (folder, *folder.parents) if (ROOT / one).is_dir())


class Results:
    """The result of each mutant of a sample, on the disk, so that a sample can be tried in slices."""

    def __init__(self, path: Path) -> None:
        """Continue with what the file holds."""
        self._path = path
        self._all: dict[str, list[str]] = json.loads(path.read_text()) if path.exists() else {}

    def lives(self, number: int) -> bool:
        """Tell whether a mutant was not noticed yet."""
        return not self._all.get(str(number), ["", ""])[1]

    def untried(self, number: int, mutant: Mutant, near: bool) -> bool:
        """Tell whether a mutant was not tried before, or only with the tests near it where others are asked now."""
        known, noticed_by, only_near = self._all.get(str(number), ["", "", ""])
        return known != f"{mutant.path}:{mutant.line}  {mutant.what}" or (
            bool(only_near) and not noticed_by and not near
        )

    def keep(self, number: int, mutant: Mutant, noticed_by: str, near: bool) -> None:
        """Keep the result of one."""
        self._all[str(number)] = [f"{mutant.path}:{mutant.line}  {mutant.what}", noticed_by, "near" * near]
        self._path.write_text(json.dumps(self._all, indent=1))

    def summary(self) -> int:
        """Print how many were noticed and who lived; return 0 where enough were noticed."""
        lived = {number: one for number, (one, noticed_by, _) in self._all.items() if not noticed_by}
        dead = len(self._all) - len(lived)
        print(f"\n{dead} of {len(self._all)} were noticed ({100 * dead / max(1, len(self._all)):.0f} %); survivors:")
        print("\n".join(f"{number:>6}  {one}" for number, one in lived.items()) or "  none")
        return int(dead < ENOUGH * len(self._all))


class Copy:
    """A copy of the project in which mutants live, one at a time."""

    def __init__(self, place: Path) -> None:
        """Bring the copy in a folder up to date, and the map of its tests."""
        self.place, self._root = place.resolve(), place.resolve() / "project"
        place.mkdir(parents=True, exist_ok=True)
        _mirror(ROOT, self._root)
        if (ROOT.parent / "shared").exists() and not (place / "shared").exists():
            (place / "shared").symlink_to((ROOT.parent / "shared").resolve())
        sys.path.insert(0, str(self._root / "src"))
        os.environ |= {"PYTHONPATH": str(self._root / "src"), "PYTHONDONTWRITEBYTECODE": "1"}
        forks.warm_up()
        self._reads = self._read_by_kernels()
        self._compiled, self._tried = self._kernels()
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

    def noticed(self, mutant: Mutant, files: list[Path], only_near: bool = False) -> str:
        """Return which test noticed a mutant, "late" with a name where tests did not end; "" for none.

        Args:
            mutant: The change.
            files: The test files that may be asked; first come those that name the module or bear its name.
            only_near: Ask no others, if there are such; else those of the folder that mirrors the module's come next.
        """
        near, far = self._near_and_far(mutant, files)
        asked = [*([one] for one in near), *([] if only_near and near else [far])]
        return next(filter(None, (self._asked(mutant, some) for some in asked)), "")

    def sieved(self, mutant: Mutant, files: list[Path]) -> str:
        """Return which test noticed a mutant, of the first few near it, for `SIEVE_SECONDS`; "" for none.

        "late" with a name where they end in time without the mutant only.

        Where most test files would be read for one mutant only, to map them first costs more than to ask them. Where
        none names the module, tests of the modules that import it are asked, else those of its folder.
        """
        near, far = self._near_and_far(mutant, files)
        if not near:
            users = self._importing(_name(mutant.path))
            near = [one for one in files if any(self._is_near(one, user) for user in users)]
        near.sort(
            key=lambda one: (one != self._root / mutant.path, not self._bears(one, mutant.path))
        )  # examples first
        asked = [one.relative_to(self._root).as_posix() for one in (near or far)[:SIEVE_FILES]]
        if SETTINGS.search((self._root / mutant.path).read_text("utf-8")):
            asked.append(SETTINGS_PAGE)
        unfit: list[str] = []
        plainly = bool(self.read_by(mutant.path))
        allowed = INTERPRETED_SECONDS if plainly else SIEVE_SECONDS
        while asked:
            with self._living(mutant):
                code, output = self._run(
                    [*asked, *(f"--deselect={one}" for one in unfit)], allowed, self._tried, plainly
                )
            noticing = re.findall(r"^(?:FAILED|ERROR) (\S+?(?:::.+?)?)(?: - .*)?$", output, re.MULTILINE)
            if code is None and self._run(asked, allowed, self._compiled, plainly)[0] == 0:
                return f"late: {asked[0]}"
            if code in (0, None, 5) or not noticing:
                print("" if code == 0 else f"     (the tests did not end: {code})", end="\n" * (code != 0), flush=True)
                return ""
            if self._judges(mutant, noticing[0], allowed, plainly=plainly):
                return str(noticing[0])
            unfit.append(noticing[0])
            asked = [one for one in asked if one != noticing[0]]
        return ""

    def _near_and_far(self, mutant: Mutant, files: list[Path]) -> tuple[list[Path], list[Path]]:
        """Return the test files that name a mutant's module or bear its name, and the others of its own folder."""
        mirrored = self._mirrored(mutant.path)
        near = [one for one in files if self._is_near(one, mutant.path)]
        near.sort(key=lambda one: (not one.is_relative_to(mirrored), not self._bears(one, mutant.path), one))
        return near, [one for one in files if one not in near and one.is_relative_to(mirrored)]

    def _asked(self, mutant: Mutant, files: list[Path]) -> str:
        self.map.read(files)
        tests = self._chosen(mutant, {one.relative_to(self._root).as_posix() for one in files})
        while tests:
            allowed = SLOWER * sum(self.map.costs[one] for one in tests) + COMPILING[bool(self.read_by(mutant.path))]
            with self._living(mutant):
                code, output = self._run(tests, allowed, self._tried)
            if code == 0:
                return ""
            noticing = re.findall(r"^(?:FAILED|ERROR) (\S+::.+?)(?: - .*)?$", output, re.MULTILINE)
            judge = next((one for one in noticing if one in self.map.costs), tests[0])
            if self._judges(mutant, judge, SLOWER * self.map.costs[judge] + COMPILING[True], late=code is None):
                return f"late: {judge}" if code is None else judge
            tests = [one for one in tests if one != judge]
        return ""

    def _judges(self, mutant: Mutant, test: str, seconds: float, late: bool = False, plainly: bool = False) -> bool:
        """Tell whether a test passes without a mutant and fails with it once more: a slow machine kills none."""
        if self._run([test], seconds, self._compiled, plainly)[0] != 0:
            if plainly:
                Hurry(self.place / "unfit.txt").leave_out(test)
            return False
        with self._living(mutant):
            code = self._run([test], seconds, self._tried, plainly)[0]
        return code != 0 and (late or code is not None)

    def _is_near(self, file: Path, path: Path) -> bool:
        """Tell whether a test file names a module or bears its name."""
        return self._bears(file, path) or bool(_imports(_name(path)).search(file.read_text("utf-8")))

    def _bears(self, file: Path, path: Path) -> bool:
        """Tell whether a test file bears a module's name, or is the module itself with its examples."""
        return file.name == f"test_{_name(path).rpartition('.')[2]}.py" or file == self._root / path

    def _mirrored(self, path: Path) -> Path:
        """Return the folder of tests that mirrors a module's own, or the nearest above it."""
        folder = self._root / "tests" / Path(*path.parent.parts[2:])
        return next(one for one in (folder, *folder.parents) if one.is_dir())

    def _chosen(self, mutant: Mutant, files: set[str]) -> list[str]:
        """Return the tests of some files to ask: those that run the line; else those that run or name the module.

        Where there are none either, those that run what imports it.
        """
        path = mutant.path
        tests = self.map.running(path, files, mutant.line, mutant.last_line)
        if not tests:
            near = {one for one in files if self._is_near(self._root / one, path)}
            tests = self.map.running(path, files) | {one for one in self.map.costs if one.split("::")[0] in near}
        if not tests:
            compiled = [_name(kernel) for kernel in self.read_by(path)]
            users = {user for one in (_name(path), *compiled) for user in self._importing(one)}
            tests = set().union(*(self.map.running(user, files) for user in users))
        asked: list[str] = []
        cost = 0.0
        for test in sorted(tests, key=lambda one: (self.map.costs[one], one)):
            cost += self.map.costs[test]
            if asked and cost > BUDGET_SECONDS:
                break
            asked.append(test)
        return asked

    def _importing(self, name: str) -> list[Path]:
        """Return the modules of the package that import a module, from the root of the repository."""
        imports = _imports(name)
        every = (self._root / SOURCES).rglob("*.py")
        return [one.relative_to(self._root) for one in every if imports.search(one.read_text("utf-8"))]

    def _run(
        self, tests: list[str], cpu_seconds: float, compiled: Path, plainly: bool = False
    ) -> tuple[int | None, str]:
        """Ask tests, kernels compiled or run by Python; return pytest's exit status, None if late, and its output."""
        log = self.place / "output.log"

        def act() -> int:
            import pytest

            _keep_kernels_in(compiled)
            if plainly:
                interpret()
            options = ("-q", "-x", "-rfE", "--tb=line", "-p", "no:cacheprovider", "-p", "no:xdist", "-o", "timeout=0")
            return int(pytest.main([*options, *tests], plugins=[Hurry(self.place / "unfit.txt")] if plainly else []))

        code = forks.in_fork(act, self._root, log, cpu_seconds)
        return code, log.read_text(errors="replace")

    @contextlib.contextmanager
    def _living(self, mutant: Mutant) -> Iterator[None]:
        """Put a mutant into the copy for a while, with compiled kernels that know nothing of what it changes."""
        path = self._root / mutant.path
        source, before = path.read_text(encoding="utf-8"), path.stat()
        self._compiled.mkdir(parents=True, exist_ok=True)
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
            os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))  # by which Numba knows what it compiled

    def _kernels(self) -> tuple[Path, Path]:
        """Return the folders of compiled kernels, without a mutant and with one; those of this machine are reused.

        Both have the same name: by it a kernel knows its sources, and under another it would be compiled again.
        """
        from racecraft.kernels import compile as kernels

        known = kernels.cache_folder()
        compiled = self.place / "compiled" / known.name
        if known.exists() and not compiled.exists():
            shutil.copytree(known, compiled)
        return compiled, self.place / "compiled-with-mutant" / known.name

    def _read_by_kernels(self) -> dict[Path, set[Path]]:
        from racecraft.kernels import compile as kernels

        package = self._root / SOURCES
        return {path: set(kernels.read_by(path, package)) for path in package.rglob("kernels/*.py")}


def _name(path: Path) -> str:
    return ".".join(path.with_suffix("").parts[path.parts.index("racecraft") :]).removesuffix(".__init__")


def _imports(name: str) -> re.Pattern[str]:
    """Return the pattern of the imports of a module."""
    parent, _, last = (re.escape(part) for part in name.rpartition("."))
    return re.compile(rf"{re.escape(name)}\b|from {parent} import [^\n]*\b{last}\b")


def _keep_kernels_in(folder: Path) -> None:
    import numba

    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    numba.config.CACHE_DIR = str(folder)


def _mirror(source: Path, target: Path) -> None:
    """Make a folder the same as another, times and all, and touch nothing in it that is the same already."""
    leave = {".git", ".venv", ".venvs", ".hypothesis", "runs", "out", "shared", "site", "build", "dist"}

    def left(folder: str, names: list[str]) -> set[str]:
        here = leave.intersection(names) if Path(folder) == source else set()
        return here | {one for one in names if one == "__pycache__" or one.endswith("_cache")}

    def copied(one: str, other: str) -> None:
        if not os.path.exists(other) or Path(one).read_bytes() != Path(other).read_bytes():
            shutil.copy2(one, other)

    shutil.copytree(source, target, ignore=left, copy_function=copied, dirs_exist_ok=True)
    for one in [*target.rglob("*.py")]:
        if not (source / one.relative_to(target)).exists():
            one.unlink()


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
