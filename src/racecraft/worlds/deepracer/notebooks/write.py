"""Write the notebooks of `files/`, and the modules that they import, into a folder. Begin with `write_notebooks`.

In a notebook "<LOGS>", "<RUN>", "<RUNS>" and "<TRACK>" stand for what it begins with.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from pathlib import Path

from racecraft.contract.errors import UserInputError
from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.formats.run_folder import JOB

FILES = Path(__file__).parent / "files"
NOTEBOOKS = tuple(sorted(path.name for path in FILES.glob("*.ipynb")))
"""Names as racers know them."""
MODULES = tuple(sorted(path.name for path in FILES.glob("*.py")))


class NotebookError(UserInputError):
    """Notebooks cannot be written where they were asked for."""


def write_notebooks(
    folder: str | Path,
    logs: str = "",
    run: str = "",
    track: str = "reinvent_base",
    replace: bool = False,
    names: Collection[str] = NOTEBOOKS,
) -> list[Path]:
    """Write notebooks and the modules that they import.

    Args:
        folder: Where; it is made.
        logs: The log they begin with; "": the run.
        run: The run folder they begin with; "": the log, if it is one, else the newest in `runs`, if there is one.
        track: What is trained on.
        replace: Whether files of theirs that are there already are written anew.
        names: Which of NOTEBOOKS; others are left out.

    Returns:
        What was written.

    Raises:
        NotebookError: A file is there already, and `replace` is off; nothing is written then.
        OutputFileError: The folder cannot be written.
    """
    place = Path(folder)
    texts = {name: (FILES / name).read_text(encoding="utf-8") for name in NOTEBOOKS if name in names}
    modules = [name for name in MODULES if any(f"import {Path(name).stem}" in text for text in texts.values())]
    there = [name for name in (*texts, *modules) if (place / name).exists()]
    if there and not replace:
        raise NotebookError(
            "{place}: is there already; expected a folder without {note}. "
            "Name another, or add --replace, which loses what you changed in them.",
            place=place / there[0],
            note="it" if len(there) == 1 else "them",
        )
    begins = _beginnings(logs, run, track)
    make_folder(place)
    for name, text in texts.items():
        write_atomic(place / name, _filled(text, begins))
    for name in modules:
        write_atomic(place / name, (FILES / name).read_text(encoding="utf-8"))
    return [place / name for name in (*texts, *modules)]


def _beginnings(logs: str, run: str, track: str) -> dict[str, str]:
    """Return what a notebook begins with, by the name that stands for it."""
    if not run:
        run = logs if (Path(logs) / JOB).is_file() else str(newest_run())
    run = str(Path(run).absolute())
    logs = str(Path(logs).absolute()) if logs else run
    return {"<LOGS>": logs, "<RUN>": run, "<RUNS>": str(Path(logs).parent), "<TRACK>": track}


def write_named(folder: Path, names: Collection[str]) -> list[Path]:
    """Write those notebooks of these names that are NOTEBOOKS, in any case of letters, with what they import."""
    asked = {name.casefold() for name in names}
    known = [name for name in NOTEBOOKS if name.casefold() in asked]
    return write_notebooks(folder, names=known) if known else []


def newest_run(root: str | Path = "runs") -> Path:
    """Return the run folder that was written last; a name to fill in where there is none."""
    runs = [path.parent for path in Path(root).glob(f"*/{JOB}")]
    return max(runs, key=lambda path: path.stat().st_mtime, default=Path(root) / "reinvent_base-1")


def _filled(text: str, begins: dict[str, str]) -> str:
    """Return a notebook's text with Python literals of `begins` in place of their quoted names."""
    notebook = json.loads(text)
    for cell in notebook["cells"]:
        for name, value in begins.items():
            cell["source"] = [line.replace(f'"{name}"', repr(value)) for line in cell["source"]]
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"
