"""Which job is at work for which run id of an installation, so that a stop or a log finds it from any terminal.

Begin with `record_job` and `job_of`. A run id has a file of its own, `.racecraft/run-<id>.json`, so that several ids
are used at once and no two write one file.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.formats.json_text import read_json

FOLDER = ".racecraft"
TRAINING, EVALUATION, VIEWER = "training", "evaluation", "viewer"


class BookError(InputFileError):
    """The file in which an installation notes its jobs is damaged."""


@dataclass(frozen=True)
class RecordedJob:
    """A job that was begun."""

    job: str
    """Its name, as `racecraft jobs` knows it."""
    run: str
    """The run folder it works on."""


def record_job(installation: Path, run_id: int, kind: str, noted: RecordedJob) -> None:
    """Note the latest training or evaluation of a run id; the one before is forgotten.

    Raises:
        OutputFileError: The installation cannot be written to.
        BookError: What stands there is damaged.
    """
    path = _path(installation, run_id)
    make_folder(path.parent)
    write_atomic(path, json.dumps({**_read(path), kind: asdict(noted)}, indent=2) + "\n")


def job_of(installation: Path, run_id: int, kind: str) -> RecordedJob | None:
    """Return the latest training or evaluation of a run id; None where none was begun.

    Raises:
        BookError: The file is damaged.
    """
    path = _path(installation, run_id)
    noted = _read(path).get(kind)
    if noted is None:
        return None
    if not isinstance(noted, dict) or set(noted) != {"job", "run"}:
        raise BookError(
            path, Message("{noted!r}", noted=noted), 'an object with "job" and "run"', "Take the file away.", key=kind
        )
    return RecordedJob(str(noted["job"]), str(noted["run"]))


def _path(installation: Path, run_id: int) -> Path:
    return installation / FOLDER / f"run-{run_id}.json"


def _read(path: Path) -> dict[str, object]:
    if not path.exists():
        return {}
    value = read_json(path, BookError, "the file in which racecraft notes its jobs").value
    if not isinstance(value, dict):
        raise BookError(path, Message("{value!r}", value=value), "a JSON object", "Take the file away.")
    return value
