"""An AWS model folder: where DeepRacer for Cloud puts each file of a training, and where its readers look for it.

Begin with `AwsModelFolder`. One worker's layout, below the folder's own path::

    model/model_metadata.json                               the car
    model/deepracer_checkpoints.json                        which checkpoint is best, which last
    ip/hyperparameters.json                                 how it learns
    training_params.yaml                                    what the simulator was told
    training-simtrace/N-iteration.csv                       every tick of iteration N
    metrics/TrainingMetrics.json                            one row an episode
    logs/training/simulation.log                            the ticks again, as log readers want them
    evaluation-<14>/evaluation-simtrace/0-iteration.csv     every tick of an evaluation
    metrics/evaluation/evaluation-<14>.json                 one row a lap

`<14>` are the fourteen digits of a moment, year first. Checkpoints themselves are ours and lie elsewhere: AWS's are
TensorFlow's.

Source: facts: simapp `boto/s3/constants.py`, deepracer-utils `handler.py` (who finds what where).
"""

from __future__ import annotations

import datetime
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError
from racecraft.formats.atomic import write_atomic
from racecraft.formats.json_text import JsonDocument, as_number, read_json

_KIND = 'a JSON object with "best_checkpoint" and "last_checkpoint"'
_NAME = re.compile(r"(\d+)_Step-(\d+)\.ckpt")
_TRACE = re.compile(r"(\d+)-iteration\.csv")


class CheckpointMarksError(InputFileError):
    """`deepracer_checkpoints.json` is missing, damaged, or of another kind."""


@dataclass(frozen=True)
class AwsModelFolder:
    """A folder in the layout of one worker."""

    path: Path

    @property
    def model_metadata(self) -> Path:
        """The car."""
        return self.path / "model" / "model_metadata.json"

    @property
    def checkpoint_marks(self) -> Path:
        """Which checkpoint is best, which last."""
        return self.path / "model" / "deepracer_checkpoints.json"

    @property
    def hyperparameters(self) -> Path:
        """How it learns."""
        return self.path / "ip" / "hyperparameters.json"

    @property
    def training_params(self) -> Path:
        """What the simulator was told."""
        return self.path / "training_params.yaml"

    @property
    def training_metrics(self) -> Path:
        """One row an episode."""
        return self.path / "metrics" / "TrainingMetrics.json"

    @property
    def simulation_log(self) -> Path:
        """The log of a training."""
        return self.path / "logs" / "training" / "simulation.log"

    def training_trace(self, iteration: int) -> Path:
        """Every tick of an iteration, counted from 0."""
        return self.path / "training-simtrace" / f"{iteration}-iteration.csv"

    def training_traces(self) -> dict[int, Path]:
        """Return the traces that stand there, by iteration, in order."""
        folder = self.path / "training-simtrace"
        found = {path: _TRACE.fullmatch(path.name) for path in folder.iterdir()} if folder.is_dir() else {}
        return dict(sorted((int(match[1]), path) for path, match in found.items() if match))

    def evaluation_trace(self, stamp: str) -> Path:
        """Every tick of the evaluation of a moment; readers look for iteration 0 only."""
        return self.path / f"evaluation-{stamp}" / "evaluation-simtrace" / "0-iteration.csv"

    def evaluation_metrics(self, stamp: str) -> Path:
        """One row a lap of the evaluation of a moment."""
        return self.path / "metrics" / "evaluation" / f"evaluation-{stamp}.json"

    def free_stamp(self, moment: datetime.datetime) -> str:
        """Return the fourteen digits of a moment, or of the first second after it that no evaluation has taken."""
        while True:
            stamp = moment.strftime("%Y%m%d%H%M%S")
            if not self.evaluation_trace(stamp).parents[1].exists():
                return stamp
            moment += datetime.timedelta(seconds=1)


@dataclass(frozen=True)
class CheckpointMark:
    """What is said of one checkpoint."""

    iteration: int
    """Counted from 0, the untrained one."""
    steps: int
    """Steps of experience until then."""
    score: float | None
    """Mean of its evaluation, by the metric that chooses the best (per cent of progress); None: it had none."""
    time_stamp: float
    """When it was taken, seconds since 1970 (UTC)."""

    @property
    def name(self) -> str:
        """The checkpoint in AWS's words.

        >>> CheckpointMark(12, 3456, 87.4, 0.0).name
        '12_Step-3456.ckpt'
        """
        return f"{self.iteration}_Step-{self.steps}.ckpt"


def checkpoint_marks_text(best: CheckpointMark, last: CheckpointMark) -> str:
    """Return the text of `deepracer_checkpoints.json`."""
    return json.dumps({"best_checkpoint": _as_aws(best), "last_checkpoint": _as_aws(last)})


def write_checkpoint_marks(path: str | Path, best: CheckpointMark, last: CheckpointMark) -> None:
    """Write which checkpoint is best and which last.

    Raises:
        OutputFileError: The file cannot be written.
    """
    write_atomic(path, checkpoint_marks_text(best, last))


def read_checkpoint_marks(path: str | Path) -> tuple[CheckpointMark, CheckpointMark]:
    """Return (best, last); older files' `avg_comp_pct` is read as the score.

    Raises:
        CheckpointMarksError: The file is missing or no JSON, or a mark lacks its name or holds a wrong value.
    """
    document = read_json(path, CheckpointMarksError, _KIND)
    if not isinstance(document.value, dict):
        raise CheckpointMarksError(path, "the file holds no JSON object", _KIND, line=1)
    return _mark(document, "best_checkpoint"), _mark(document, "last_checkpoint")


def _as_aws(mark: CheckpointMark) -> dict[str, Any]:
    return {"name": mark.name, "avg_eval_metric": mark.score, "time_stamp": mark.time_stamp}


def _mark(document: JsonDocument, key: str) -> CheckpointMark:
    entry = document.value.get(key)
    if not isinstance(entry, dict):
        found = "there is no such key" if entry is None else repr(entry)
        raise CheckpointMarksError(document.path, found, _KIND, key=key)
    match = _NAME.fullmatch(str(entry.get("name")))
    if match is None:
        raise document.error_at(key, "name", found=repr(entry.get("name")), expected="a name like 12_Step-3456.ckpt")
    score_key = "avg_eval_metric" if "avg_eval_metric" in entry else "avg_comp_pct"
    score, time_stamp = (_number(document, key, name) for name in (score_key, "time_stamp"))
    return CheckpointMark(int(match[1]), int(match[2]), score, time_stamp or 0.0)


def _number(document: JsonDocument, key: str, name: str) -> float | None:
    written = document.value[key].get(name)
    number = None if written is None else as_number(written)
    if written is not None and number is None:
        raise document.error_at(key, name, found=repr(written), expected="a number")
    return None if number is None else float(number)
