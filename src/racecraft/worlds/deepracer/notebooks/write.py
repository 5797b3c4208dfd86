"""Write the notebooks of `files/`, and the modules that they import, into a folder. Begin with `write_notebooks`.

In a notebook "<LOGS>", "<RUN>", "<RUNS>" and "<TRACK>" stand for what it begins with.
"""

from __future__ import annotations

import json
from pathlib import Path

from racecraft.contract.errors import UserInputError
from racecraft.formats.atomic import make_folder, write_atomic

FILES = Path(__file__).parent / "files"
NOTEBOOKS = tuple(sorted(path.name for path in FILES.glob("*.ipynb")))
"""Names as racers know them."""
MODULES = tuple(sorted(path.name for path in FILES.glob("*.py")))


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
            "{place}: is there already; expected a folder without {note}. "
            "Name another, or add --replace, which loses what you changed in them.",
            place=place / there[0],
            note="it" if len(there) == 1 else "them",
        )
    run = str(Path(run or newest_run()).absolute())
    begins = {"<LOGS>": str(Path(logs).absolute()) if logs else run, "<RUN>": run, "<RUNS>": str(Path(run).parent),
              "<TRACK>": track}  # fmt: skip
    make_folder(place)
    for name in NOTEBOOKS:
        write_atomic(place / name, _filled((FILES / name).read_text(encoding="utf-8"), begins))
    for name in MODULES:
        write_atomic(place / name, (FILES / name).read_text(encoding="utf-8"))
    return [place / name for name in (*NOTEBOOKS, *MODULES)]


def newest_run(root: str | Path = "runs") -> Path:
    """Return the run folder that was written last; a name to fill in where there is none."""
    runs = [path.parent for path in Path(root).glob("*/job.json")]
    return max(runs, key=lambda path: path.stat().st_mtime, default=Path(root) / "reinvent_base-1")


def _filled(text: str, begins: dict[str, str]) -> str:
    """Return a notebook's text with Python literals of `begins` in place of their quoted names."""
    notebook = json.loads(text)
    for cell in notebook["cells"]:
        for name, value in begins.items():
            cell["source"] = [line.replace(f'"{name}"', repr(value)) for line in cell["source"]]
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"
