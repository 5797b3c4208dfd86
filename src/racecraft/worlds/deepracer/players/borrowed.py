"""A model of AWS's, opened as a run. What knows cars and tracks is imported when a model is met."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from pathlib import Path

from racecraft.formats.archive import is_archive
from racecraft.formats.run_folder import JOB, RunFolder
from racecraft.worlds.deepracer.files.trained_model import looks_foreign


def is_foreign(path: str | Path) -> bool:
    """Tell whether a path is no run of ours but may be a model of AWS's: archive, folder, graph or checkpoint."""
    path = Path(path)
    return not (path / JOB).is_file() and (is_archive(path) or looks_foreign(path))


def borrowed_run(source: str | Path) -> RunFolder | None:
    """Return a model of AWS's as a run folder that lives as long as this process; None for anything else.

    Raises:
        UserInputError: It cannot be used.
    """
    if not is_foreign(source):
        return None
    from racecraft.worlds.deepracer.players.foreign_model import import_model, name_of

    folder = tempfile.mkdtemp(prefix="racecraft-model-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return import_model(source, Path(folder) / name_of(Path(source))).run
