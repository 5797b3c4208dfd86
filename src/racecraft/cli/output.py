"""Where words and numbers go: people read standard error while `--json` owns standard output."""

from __future__ import annotations

import dataclasses
import json
import math
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

WIDE = 250
"""Columns of a pipe: it has no width, and whoever reads it wants every word."""


def print_json(value: Any) -> None:
    """Print a result as one JSON object on one line of standard output; what is no number in JSON becomes null."""
    print(json.dumps(_plain(value), ensure_ascii=False), flush=True)


def echo(text: str, *, quiet_stdout: bool) -> None:
    """Print a line for people: to standard error where standard output belongs to `--json`."""
    print(text, file=sys.stderr if quiet_stdout else sys.stdout, flush=True)


def word(path: object) -> str:
    """Return a path as a shell takes it: a command that is printed is a command that is pasted.

    >>> print(word("runs/oval-1"), word("my cars/runs/oval-1"))
    runs/oval-1 'my cars/runs/oval-1'
    """
    return shlex.quote(str(path))


def print_files(files: Mapping[str, object]) -> None:
    """Print which files were written, a line each: "page: report.html"."""
    for kind, path in files.items():
        print(f"{kind}: {path}")


def print_next_steps(*commands: tuple[str, str]) -> None:
    """Print commands to try next, each with what it is for above it.

    Not behind it: zsh as it comes knows no comments where one types, and takes their apostrophes for quotes.
    """
    for what, command in commands:
        print(f"  {what}\n    {command}")


def console() -> Console:
    """Return where tables are printed: as wide as the terminal, and wide where there is none."""
    from rich.console import Console

    made = Console()
    if not made.is_terminal:
        made.width = WIDE
    return made


@contextmanager
def counting(what: str, *, quiet_stdout: bool) -> Iterator[Callable[[int, int], None]]:
    """Yield what hears how much is done, and of how much, and shows it on a terminal; elsewhere nobody is told.

    Args:
        what: Is counted: "pictures".
        quiet_stdout: Standard output belongs to `--json`; the bar is then shown on standard error.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=quiet_stdout)
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn(what), TimeRemainingColumn(compact=True))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task(what, total=None)
        yield lambda done, whole: progress.update(task, completed=done, total=whole)


def table(
    titles: Sequence[str], rows: Iterable[Sequence[str]], left: Sequence[str] = (), whole: Sequence[str] = ()
) -> None:
    """Print rows below their titles, figures to the right.

    Args:
        titles: Of the columns.
        rows: A cell a column.
        left: Columns that stand to the left.
        whole: Columns that are not broken on a narrow terminal.
    """
    from rich.table import Table

    made = Table(box=None, pad_edge=False, header_style="bold")
    for title in titles:
        made.add_column(title, justify="left" if title in left else "right", no_wrap=title in whole)
    for row in rows:
        made.add_row(*row)
    print_table(made)


def print_table(table: Table) -> None:
    """Print a table, whole; in a pipe no word of it is cut."""
    console().print(table)


def _plain(value: Any) -> Any:
    """Return a value as JSON has it: a result as it says itself (`as_dictionary`), or its fields by name."""
    if hasattr(value, "as_dictionary"):
        return _plain(value.as_dictionary())
    if dataclasses.is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
