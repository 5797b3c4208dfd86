"""A run by its path: a run folder, or another program's model that a world opens as one. Begin with `open_run`."""

from __future__ import annotations

from pathlib import Path

from racecraft.contract.kinds import kinds
from racecraft.formats.run_folder import JOB, RunFolder


def open_run(source: str | Path) -> RunFolder:
    """Return a run folder as it is; of another program's model, a run that lasts as long as this process.

    Raises:
        UserInputError: It is neither, or cannot be used.
    """
    if not (Path(source) / JOB).is_file():
        for kind in kinds():
            opened = kind.piece("open_run")
            run: RunFolder | None = opened(str(source)) if opened else None
            if run is not None:
                return run
    return RunFolder.open(source)
