"""A notebook run from its first cell to its last, without Jupyter. Begin with `run_notebook`.

A cell that is not Python as it stands is read once more, line by line: `%magic` lines go, `%%writefile FILE` writes,
and what a shell would be asked (`!command`, `%%bash`) is said and not run, for what those lines install, build or copy
to the cloud is not wanted here. The value of a cell's last line is shown, figures of matplotlib are kept as pictures.
"""

from __future__ import annotations

import ast
import builtins
import linecache
import os
import re
import sys
import types
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.compat.undefined_names import sentence, unset_names
from racecraft.contract.errors import InputFileError, SettingError
from racecraft.contract.message import Message
from racecraft.formats.atomic import write_atomic
from racecraft.formats.json_text import parse_json
from racecraft.formats.user_file import read_regular

SUFFIX = ".ipynb"
ASKS_A_SHELL = "_asks_a_shell"
"""What stands for a line that a shell would be asked."""
SHELL_CELLS = ("bash", "sh", "script", "system", "sx", "html", "javascript", "js", "svg", "latex", "perl", "ruby")
"""Cells of another language, behind %%."""
PYPLOT = "matplotlib.pyplot"
LetterAbout = Callable[[BaseException], str]
_SHELL = re.compile(r"^(?P<before>\s*(?:[\w.,\s]+=\s*)?)!(?P<command>.*)$")
_MAGIC = re.compile(r"^(?P<before>\s*)(?:%|\?)\S.*$")


@dataclass(frozen=True)
class Cell:
    """A cell of Python's."""

    number: int
    """Counted from 1, cells of text in, as the notebook shows them."""
    source: str


def run_notebook(path: Path, goes_on: bool = False, error_about: LetterAbout = lambda error: "") -> None:
    """Run every cell of Python's in one module, `__main__`.

    Args:
        path: The notebook.
        goes_on: Whether a cell that fails is told of, and the next one run.
        error_about: Tells of an error in words of ours, where there are any.

    Raises:
        SettingError: Cells failed, and the others were run.
        InputFileError: It is no notebook.
        Exception: What a cell raised, with a note of which.
    """
    os.environ.setdefault("MPLBACKEND", "Agg")
    before = sys.modules.get("__main__")
    module = types.ModuleType("__main__")
    module.__dict__.update({"__file__": str(path), "__builtins__": builtins, ASKS_A_SHELL: _say_not_run, **_SHOWS})
    sys.modules["__main__"] = module
    try:
        cells = list(cells_of(path))
        for index, name in unset_names([cell.source for cell in cells], module.__dict__):
            print(f"- cell {cells[index].number}: {sentence(name)}", flush=True)
        failed = [cell.number for cell in cells if not _ran(cell, path, module.__dict__, goes_on, error_about)]
    finally:
        if before is not None:
            sys.modules["__main__"] = before
    if failed:
        numbers = ", ".join(map(str, failed))
        raise SettingError(
            "{name}: cell {numbers} failed, as told above; the others were run.", name=path.name, numbers=numbers
        )


def cells_of(path: Path) -> Iterator[Cell]:
    """Yield the cells of Python's, magic lines taken out.

    Raises:
        InputFileError: It is no notebook.
    """
    expected = "a notebook of Jupyter's, with cells of Python"
    try:
        notebook = parse_json(read_regular(path))
        cells = [(one["cell_type"], "".join(one["source"])) for one in notebook["cells"]]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputFileError(
            path,
            Message("it cannot be read ({type_name}: {error})", type_name=type(error).__name__, error=error),
            expected,
        ) from error
    for number, (kind, source) in enumerate(cells, 1):
        if kind == "code" and source.strip():
            yield Cell(number, python_of(source))


def python_of(source: str) -> str:
    r"""Return a cell as Python.

    >>> python_of("%%time\nif local:\n    !pip install x\nprint(1)")
    "\nif local:\n    _asks_a_shell('pip install x')\nprint(1)"
    """
    try:
        ast.parse(source)
        return source
    except SyntaxError:
        pass
    first, _, rest = source.lstrip().partition("\n")
    word, _, named = first.removeprefix("%%").strip().partition(" ")
    if first.startswith("%%") and word == "writefile":
        return f"_write_file({named.split()[-1]!r}, {rest!r})" if named else rest
    if first.startswith("%%") and word in SHELL_CELLS:
        return f"{ASKS_A_SHELL}({first!r})"
    return "\n".join(map(_line, source.split("\n")))


def _line(line: str) -> str:
    match = _SHELL.match(line)
    if match is not None:
        return f"{match['before']}{ASKS_A_SHELL}({match['command'].strip()!r})"
    magic = _MAGIC.match(line)
    if magic is None:
        return line
    return f"{magic['before']}pass" if magic["before"] else ""


def _ran(cell: Cell, path: Path, names: dict[str, Any], goes_on: bool, error_about: LetterAbout) -> bool:
    """Run a cell; tell whether it came to its end."""
    try:
        _run(cell, path, names)
    except Exception as error:
        if not goes_on:
            raise
        notes = "".join(f"\n  {note}" for note in getattr(error, "__notes__", ()))
        print(f"- {error_about(error) or f'{type(error).__name__}: {error}{notes}'}", flush=True)
        return False
    return True


def _run(cell: Cell, path: Path, names: dict[str, Any]) -> None:
    where = f"{path.name}, cell {cell.number}"
    linecache.cache[where] = (len(cell.source), None, cell.source.splitlines(keepends=True), where)
    others = set(_open_figures())
    try:
        tree = ast.parse(cell.source, where)
        last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, where, "exec"), names)
        if isinstance(last, ast.Expr):
            _show(eval(compile(ast.Expression(last.value), where, "eval"), names))
    except Exception as error:
        error.add_note(f"in cell {cell.number} of {path.name}")
        raise
    _keep_figures(path, cell.number, others)


def _show(*values: Any) -> None:
    for value in values:
        if value is not None and not isinstance(value, _Nothing):
            print(value if isinstance(value, str) and len(values) > 1 else repr(value), flush=True)


class _Nothing(list[str]):
    """What a shell that was not asked answered."""


def _say_not_run(command: str) -> _Nothing:
    print(f"- not run: {command}", flush=True)
    return _Nothing()


def _write_file(name: str, text: str) -> None:
    write_atomic(Path(name), text)
    print(f"- {name} written")


def _open_figures() -> list[int]:
    """Return the numbers of Matplotlib's open figures; none where it was not imported."""
    plot: Any = sys.modules.get(PYPLOT)
    return [] if plot is None else plot.get_fignums()


def _keep_figures(path: Path, number: int, others: Collection[int]) -> None:
    """Keep what a cell drew beside the notebook's run, there being nobody to show it to; `others` were open before."""
    drawn = [figure for figure in _open_figures() if figure not in others]
    for place, figure in enumerate(drawn):
        plot: Any = sys.modules[PYPLOT]
        name = f"{path.stem}-cell-{number}{f'-{place + 1}' if place else ''}.png"
        plot.figure(figure).savefig(name)
        print(f"- {name}: what cell {number} drew")
        plot.close(figure)


_SHOWS = {"display": _show, "_write_file": _write_file}
