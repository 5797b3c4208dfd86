"""Write the notebooks: Jupyter's format 4, by ourselves, so that nothing needs to be installed to have them."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from racecraft.contract.errors import UserInputError
from racecraft.formats.whole import make_folder, write_whole
from racecraft.worlds.deepracer.notebooks.cells import MODULES, NOTEBOOKS

NBFORMAT = (4, 5)


class NotebookError(UserInputError):
    """Notebooks cannot be written where they were asked for."""


def write_notebooks(
    folder: str | Path, logs: str = "", run: str = "", track: str = "reinvent_base", replace: bool = False
) -> list[Path]:
    """Write every notebook and the modules they share.

    Args:
        folder: Where; it is made.
        logs: The log they begin with; "": the run.
        run: The run folder they begin with; "": the newest in `runs`, if there is one.
        track: What is trained on.
        replace: Whether files of theirs that are there already are written anew.

    Returns:
        What was written.

    Raises:
        NotebookError: A file is there already, and `replace` is off; nothing is written then.
        OutputFileError: The folder cannot be written.
    """
    place = Path(folder)
    there = [name for name in (*NOTEBOOKS, *MODULES) if (place / name).exists()]
    if there and not replace:
        raise NotebookError(
            f"{place / there[0]}: is there already; expected a folder without {'it' if len(there) == 1 else 'them'}. "
            "Name another, or add --replace, which loses what you changed in them."
        )
    run = str(Path(run or newest_run()).absolute())
    words = {"logs": str(Path(logs).absolute()) if logs else run, "run": run, "runs": str(Path(run).parent),
             "track": track}  # fmt: skip
    make_folder(place)
    written = []
    for name, cells in NOTEBOOKS.items():
        write_whole(place / name, json.dumps(notebook(cells, words), indent=1, ensure_ascii=False) + "\n")
        written.append(place / name)
    for name, text in MODULES.items():
        write_whole(place / name, text)
        written.append(place / name)
    return written


def newest_run(root: str | Path = "runs") -> Path:
    """Return the run folder that was written last; a name to fill in where there is none."""
    runs = [path.parent for path in Path(root).glob("*/job.json")]
    return max(runs, key=lambda path: path.stat().st_mtime, default=Path(root) / "reinvent_base-1")


def notebook(cells: tuple[str, ...], words: dict[str, str]) -> dict[str, Any]:
    """Return a notebook of cells as plain values.

    >>> [cell["cell_type"] for cell in notebook(("# Title", "1 + 1"), {})["cells"]]
    ['markdown', 'code']
    """
    made = [_cell(number, text, words) for number, text in enumerate(cells)]
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {
        "cells": made,
        "metadata": {"kernelspec": kernel, "language_info": {"name": "python"}},
        "nbformat": NBFORMAT[0],
        "nbformat_minor": NBFORMAT[1],
    }


def _cell(number: int, text: str, words: dict[str, str]) -> dict[str, Any]:
    is_text = text.startswith("# ")
    filled = text.format(**words) if any("{" + word + "!r}" in text for word in words) else text
    ident = hashlib.sha256(f"{number} {text}".encode()).hexdigest()[:8]
    cell: dict[str, Any] = {"cell_type": "markdown" if is_text else "code", "id": ident, "metadata": {}}
    if not is_text:
        cell |= {"execution_count": None, "outputs": []}
    return cell | {"source": filled.splitlines(keepends=True)}
