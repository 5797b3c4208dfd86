"""A model of AWS's, opened as a run. What knows cars and tracks is imported when a model is met."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from pathlib import Path

from racecraft.formats.archive import is_archive
from racecraft.formats.checkpoint_ranking import split_source
from racecraft.formats.run_folder import JOB, MODEL_METADATA, RunFolder
from racecraft.worlds.deepracer.files.model_metadata import ModelMetadata, write_model_metadata
from racecraft.worlds.deepracer.files.trained_model import looks_like_aws_model, metadata_beside


def is_aws_model(path: str | Path) -> bool:
    """Tell whether a path is no run of ours but may be a model of AWS's: archive, folder, graph or checkpoint."""
    path = Path(path)
    return not (path / JOB).is_file() and (is_archive(path) or looks_like_aws_model(path))


def with_metadata(source: str | None, car: ModelMetadata) -> str | None:
    """Return what a training begins with; graphs and checkpoints without metadata beside them get that of its car.

    Args:
        source: RUN, RUN:which or a model, as after --from; None: nothing.
        car: The car that is to be trained.

    Raises:
        UserInputError: The model cannot be used.
    """
    if source is None:
        return None
    path, which = split_source(source)
    file = Path(path)
    if not file.is_file() or not looks_like_aws_model(file) or metadata_beside(file) is not None:
        return source
    with tempfile.TemporaryDirectory(prefix="racecraft-metadata-") as folder:
        metadata = Path(folder) / MODEL_METADATA
        write_model_metadata(car, metadata)
        run = open_run_or_model(file, metadata)
    return source if run is None else f"{run.path}:{which}"


def open_run_or_model(source: str | Path, metadata: Path | None = None) -> RunFolder | None:
    """Return a model of AWS's as a run folder that lives as long as this process; None for anything else.

    Args:
        source: The model.
        metadata: A model_metadata.json, where none lies beside the weights.

    Raises:
        UserInputError: It cannot be used.
    """
    if not is_aws_model(source):
        return None
    from racecraft.worlds.deepracer.players.aws_model import import_model, name_of

    folder = tempfile.mkdtemp(prefix="racecraft-model-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return import_model(source, Path(folder) / name_of(Path(source)), metadata).run
