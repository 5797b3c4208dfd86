"""What a tuner of SageMaker's shape was asked, beside its study: `tuner.json`. Begin with `read_request`.

{
"format": "racecraft tuner", "version": 1,
"estimator": {words of RLEstimator},
"tuner": {words of HyperparameterTuner; a range is {"kind": "continuous", "min_value": 0.0, "max_value": 1.0, …}}
}
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from racecraft.contract.errors import SettingError, nearest
from racecraft.formats.atomic import write_atomic
from racecraft.formats.json_text import parse_json
from racecraft.formats.user_file import read_regular
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.tuning.space import CategoricalParameter, ContinuousParameter, IntegerParameter, Parameter

FOLDER = "tunings"
"""Where searches lie, in the folder of the jobs."""
FILE = "tuner.json"
FORMAT, VERSION = "racecraft tuner", 1
RANGES = "hyperparameter_ranges"
KINDS = {"continuous": ContinuousParameter, "integer": IntegerParameter, "categorical": CategoricalParameter}


@dataclass(frozen=True)
class TunerRequest:
    """What was asked."""

    estimator: Mapping[str, Any]
    """Words that make the estimator once more."""
    tuner: Mapping[str, Any]
    """Words that make the tuner once more, beside the estimator."""


def folder_of(name: str) -> Path:
    """Return where a search lies or will lie."""
    return JobPaths.of_user().path / FOLDER / name


def job_of(name: str, number: int) -> str:
    """Return the name of a search's job.

    >>> job_of("cartpole-251123", 7)
    'cartpole-251123-007'
    """
    return f"{name}-{number:03}"


def write_request(folder: Path, request: TunerRequest) -> None:
    """Write it down.

    Raises:
        OutputFileError: It cannot be written.
    """
    ranges = {name: _as_json(one) for name, one in request.tuner[RANGES].items()}
    document = {
        "format": FORMAT,
        "version": VERSION,
        "estimator": request.estimator,
        "tuner": {**request.tuner, RANGES: ranges},
    }
    write_atomic(folder / FILE, json.dumps(document, indent=2) + "\n")


def read_request(name: str) -> TunerRequest:
    """Read what a search was asked.

    Raises:
        SettingError: There is no search of that name, or its file is of another version.
    """
    path = folder_of(name) / FILE
    if not path.is_file():
        known = sorted(one.parent.name for one in path.parents[1].glob(f"*/{FILE}"))
        there = f"There are {', '.join(known)}." if known else "There is none yet."
        raise SettingError(
            "No search is named {name!r}; expected that of an earlier fit. {there} {hint}",
            name=name,
            there=there,
            hint=nearest(name, known),
        )
    document = parse_json(read_regular(path))
    if document.get("version") != VERSION:
        raise SettingError(
            "{path} is of version {told}; expected {version}. Search anew.",
            path=path,
            told=document.get("version"),
            version=VERSION,
        )
    ranges = {name: _of_json(one) for name, one in document["tuner"][RANGES].items()}
    return TunerRequest(document["estimator"], {**document["tuner"], RANGES: ranges})


def _as_json(one: Parameter) -> dict[str, Any]:
    kind = next(name for name, made in KINDS.items() if isinstance(one, made))
    return {"kind": kind, **asdict(one)}


def _of_json(values: Mapping[str, Any]) -> Parameter:
    words = {name: value for name, value in values.items() if name != "kind"}
    made: Parameter = KINDS[values["kind"]](**words)
    return made
