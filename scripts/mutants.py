"""Break the code on purpose, one small thing at a time, and see whether the tests notice. Survivors are printed.

    python scripts/mutants.py                          30 mutants, seed 1
    python scripts/mutants.py --count 300 --seed 2     another sample
    python scripts/mutants.py --count 300 --skip 60 --minutes 20    the same sample from its 61st on, for so long
    python scripts/mutants.py --in rollout formats     of some rooms only

A mutant is one change in one file: a comparison or a sum turned round, a constant moved, a condition negated, a
statement left out. It is tried in a copy of the house, so that nothing here is touched and several samples can run side
by side. First come the tests that name the module or bear its name, then, where those pass, the folder of tests that
mirrors its room; tests that fail without any mutant are left out, and tests that come to no end without one are no
judges. One that runs much longer than without a mutant counts as noticed, and is told as "late", since on a loaded
machine it may only have been unlucky. Of compiled kernels only those are compiled again that read what was changed, and
mutants of what no kernel reads are tried first. docs/decisions/0009-mutants.md says why this is a script of ours, and
which survivors were read.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from racecraft.kernels import compile as kernels

ROOT = Path(__file__).resolve().parents[1]
HOUSE = Path("src/racecraft")
ROOMS = ("contract", "envs", "algorithms", "rollout", "evaluation", "formats")
LONGEST_SECONDS = 600
UNASKED = "unasked"
PATIENCE = 4
"""A mutant may take so many times as long as the tests do without it, and a minute."""

COMPARED = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
COUNTED = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Mod: ast.FloorDiv,
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """One change."""

    path: Path
    """From the root of the repository."""
    number: int
    """Which of the file's places."""
    line: int
    what: str


def main(words: list[str]) -> int:
    """Try a sample; 0 where at least 85 % were noticed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--skip", type=int, default=0, help="so many of the sample were tried before")
    parser.add_argument("--in", dest="rooms", nargs="+", default=ROOMS, metavar="ROOM", help=", ".join(ROOMS))
    parser.add_argument("--minutes", type=float, default=1e9, help="no further mutant is begun after so long")
    parser.add_argument(
        "--near", action="store_true", help="only tests that name the module, where any does; a quick sieve"
    )
    asked = parser.parse_args(words)
    every = [mutant for room in asked.rooms for mutant in mutants_in(HOUSE / room)]
    if not every:
        parser.error(f"there is nothing to change in {', '.join(asked.rooms)}")
    sample = random.Random(asked.seed).sample(every, min(asked.count, len(every)))
    print(f"{len(sample)} of {len(every):,} mutants, seed {asked.seed}", flush=True)
    began, survivors, tried = time.monotonic(), [], 0
    numbered = list(enumerate(sample, 1))[asked.skip :]
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Copy(Path(folder))
        for number, mutant in sorted(numbered, key=lambda one: copy.costs(one[1].path)):
            if time.monotonic() - began > 60 * asked.minutes:
                break
            noticed_by = copy.noticed(mutant, asked.near)
            tried += noticed_by != UNASKED
            survivors += [] if noticed_by else [mutant]
            print(
                f"{number:4} {noticed_by or 'SURVIVES':9} {mutant.path}:{mutant.line}  {mutant.what}",
                flush=True,
            )
    dead = tried - len(survivors)
    print(f"\n{dead} of {tried} were noticed ({100 * dead / max(1, tried):.0f} %); survivors:")
    print("\n".join(f"  {one.path}:{one.line}  {one.what}" for one in survivors) or "  none")
    return int(dead < 0.85 * tried)


def mutants_in(place: Path) -> Iterator[Mutant]:
    """Yield every mutant of the modules under a place."""
    for path in sorted((ROOT / place).rglob("*.py")):
        near = path.relative_to(ROOT)
        for number, (node, what) in enumerate(places(ast.parse(path.read_text(encoding="utf-8")))):
            yield Mutant(near, number, node.lineno, what)


def places(tree: ast.Module) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    """Yield what can be changed and how, in the order of the file; docstrings, types and messages are left alone."""
    for node in _code(tree):
        if isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARED:
            yield node, f"{ast.unparse(node)}: the comparison turned round"
        elif isinstance(node, ast.BinOp) and type(node.op) in COUNTED and not _is_text(node):
            yield node, f"{ast.unparse(node)}: another operator"
        elif isinstance(node, ast.BoolOp):
            yield node, f"{ast.unparse(node)}: and for or"
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
            yield node, f"{ast.unparse(node)}: its sign left out"
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
            yield node, f"{ast.unparse(node)}: another constant"
        elif isinstance(node, ast.AugAssign) or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)):
            yield node, f"{ast.unparse(node).splitlines()[0]}: left out"


def changed(source: str, number: int) -> str:
    """Return a module's text with one of its places changed."""
    tree = ast.parse(source)
    node = list(places(tree))[number][0]
    if isinstance(node, ast.Compare):
        node.ops[0] = COMPARED[type(node.ops[0])]()
    elif isinstance(node, ast.BinOp):
        node.op = COUNTED[type(node.op)]()
    elif isinstance(node, ast.BoolOp):
        node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
    elif isinstance(node, ast.Constant):
        node.value = not node.value if isinstance(node.value, bool) else node.value + 1
    elif isinstance(node, ast.UnaryOp):
        node.op = ast.UAdd() if isinstance(node.op, ast.USub) else node.op
        node.operand = node.operand if isinstance(node.op, ast.UAdd) else ast.UnaryOp(ast.Not(), node.operand)
    else:
        _leave_out(tree, node)
    return ast.unparse(ast.fix_missing_locations(tree))


class Copy:
    """A copy of the house in which mutants live, one at a time."""

    def __init__(self, folder: Path) -> None:
        self._root = folder / "house"
        leave = shutil.ignore_patterns(".git", ".venv*", "runs", "out", "__pycache__", ".*_cache", "shared", "site")
        shutil.copytree(ROOT, self._root, ignore=leave)
        if (ROOT.parent / "shared").exists():
            (folder / "shared").symlink_to((ROOT.parent / "shared").resolve())
        self._compiled, self._tried = folder / "compiled", folder / "compiled-with-mutant"
        package = self._root / HOUSE
        self._reads = {path: set(kernels.read_by(path, package)) for path in package.rglob("kernels/*.py")}
        self._known: dict[tuple[str, ...], tuple[list[str], float, bool]] = {}

    def noticed(self, mutant: Mutant, only_near: bool = False) -> str:
        """Return what noticed a mutant: "near" tests, those of its "folder", their being "late"; "" for nobody.

        Where no tests come to an end without it, the answer is UNASKED.
        """
        near, folder = self._near(mutant.path), self._folder(mutant.path)
        asked = {"near": near, "folder": [] if only_near and near else folder}
        answer = UNASKED
        for kind, tests in asked.items():
            if not tests:
                continue
            failing, seconds, judges = self._without_mutant(tuple(tests))
            if not judges:
                continue
            with self._living(mutant):
                limit = min(LONGEST_SECONDS, 60 + PATIENCE * seconds)
                passed, said = self._run([*tests, "-x", *failing], limit, self._tried)
            if not passed:
                return kind if said else "late"
            answer = ""
        return answer

    def costs(self, path: Path) -> tuple[bool, bool]:
        """Return what sorts files by what it costs to try one of their mutants, the cheap ones first."""
        return bool(self.read_by(path)), not self._near(path)

    def read_by(self, path: Path) -> list[Path]:
        """Return the kernels that a file's numbers and functions are compiled into, itself among them."""
        return [kernel for kernel, read in self._reads.items() if self._root / path in read]

    @contextlib.contextmanager
    def _living(self, mutant: Mutant) -> Iterator[None]:
        """Put a mutant into the house for a while, with compiled kernels that know nothing of what it changes."""
        path = self._root / mutant.path
        source, told = path.read_text(encoding="utf-8"), path.stat()
        self._compiled.mkdir(exist_ok=True)
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
            shutil.rmtree(self._tried)

    def _without_mutant(self, tests: tuple[str, ...]) -> tuple[list[str], float, bool]:
        """Return the options that leave out what fails anyway, how long the tests take, and whether they end."""
        if tests not in self._known:
            self._compiled.mkdir(exist_ok=True)
            began = time.monotonic()
            passed, said = self._run([*tests], LONGEST_SECONDS, self._compiled)
            failing = re.findall(r"^(?:FAILED|ERROR) (\S+)", said, re.MULTILINE)
            took = time.monotonic() - began
            self._known[tests] = ([f"--deselect={one}" for one in failing], took, passed or bool(said))
            if not passed and not said:
                print(f"     {' '.join(tests)}: no end in {took:.0f} s without a mutant; not asked", flush=True)
        return self._known[tests]

    def _run(self, words: list[str], seconds: float, compiled: Path) -> tuple[bool, str]:
        """Run tests; return whether all passed in time, and what was said."""
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *words]
        environment = os.environ | {"PYTHONPATH": str(self._root / "src"), "PYTHONDONTWRITEBYTECODE": "1"}
        environment["NUMBA_CACHE_DIR"] = str(compiled)
        try:
            done = subprocess.run(
                command, cwd=self._root, env=environment, capture_output=True, text=True, timeout=seconds
            )
        except subprocess.TimeoutExpired:
            return False, ""
        return done.returncode in (0, 5), done.stdout

    def _near(self, path: Path) -> list[str]:
        """Return the module with its examples, and the test files that import it by its name, or bear it."""
        name = ".".join(path.with_suffix("").parts[1:]).removesuffix(".__init__")
        parent, _, last = name.rpartition(".")
        imports = re.compile(rf"{re.escape(name)}\b|from {re.escape(parent)} import [^\n]*\b{re.escape(last)}\b")
        mirrored = self._root / "tests" / path.parts[2]
        files = sorted(mirrored.rglob("test_*.py")) if mirrored.is_dir() else []
        named = f"test_{last}.py"
        near = [one for one in files if one.name == named or imports.search(one.read_text(encoding="utf-8"))]
        own = [self._root / path] if ">>> " in (self._root / path).read_text(encoding="utf-8") else []
        return [str(one.relative_to(self._root)) for one in [*own, *near]]

    def _folder(self, path: Path) -> list[str]:
        """Return the folder of tests that mirrors a module's own, or the nearest above it."""
        parts = path.parent.parts[2:]
        for depth in range(len(parts), 0, -1):
            if (self._root / "tests" / Path(*parts[:depth])).is_dir():
                return [str(Path("tests", *parts[:depth]))]
        return []


def _code(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield the nodes that do something: no annotations, no words of errors, no text."""
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop(0)
        yield node
        if isinstance(node, ast.Raise | ast.Assert | ast.JoinedStr | ast.Import | ast.ImportFrom):
            continue
        skipped = {"annotation", "returns", "decorator_list", "type_params"}
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            continue
        for name, value in ast.iter_fields(node):
            if name not in skipped:
                waiting += [one for one in (value if isinstance(value, list) else [value]) if isinstance(one, ast.AST)]


def _is_text(node: ast.BinOp) -> bool:
    return any(
        isinstance(one, ast.JoinedStr) or (isinstance(one, ast.Constant) and isinstance(one.value, str))
        for one in ast.walk(node)
    )


def _leave_out(tree: ast.Module, gone: ast.AST) -> None:
    for node in ast.walk(tree):
        for _, value in ast.iter_fields(node):
            if isinstance(value, list) and any(one is gone for one in value):
                value[[one is gone for one in value].index(True)] = ast.Pass()


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
