"""A run by its path: a run folder, or another program's model that a world opens as one. Begin with `open_run`."""

from __future__ import annotations

from pathlib import Path

from racecraft.contract.errors import RunFolderError
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
        if Path(source).is_dir():
            raise RunFolderError(
                "{path}: holds no {job} and no weights of a model; expected a run folder of racecraft, or a model of "
                "AWS with its weights. Logs alone cannot be judged.",
                path=source, job=JOB,
            )  # fmt: skip
    return RunFolder.open(source)
