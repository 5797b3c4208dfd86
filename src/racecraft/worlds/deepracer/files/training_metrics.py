"""`TrainingMetrics.json` and an evaluation's metrics: one row an episode, as AWS writes and its tools read them.

Begin with `training_row` and `evaluation_row`, which make rows from seconds and shares; `write_training_metrics`,
`write_evaluation_metrics` and `read_metrics_file` carry them to and from disk, byte for byte as AWS does.

Two habits that readers rely on: `trial` begins at 1 again in each iteration, and evaluation rows stand between the
training rows and repeat the episode and the trial of the last training row.

Source: facts: simapp `s3_metrics.py`; deepracer-utils `metrics.py` (who takes the largest trial as the length of an
iteration).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

from racecraft.contract.errors import ContractError, InputFileError, nearest
from racecraft.formats.atomic import write_atomic
from racecraft.formats.json_text import JsonDocument, read_json

STATUS_LABELS: Mapping[str, str] = {
    "prepare": "Prepare",
    "in_progress": "In progress",
    "lap_complete": "Lap complete",
    "off_track": "Off track",
    "crashed": "Crashed",
    "immobilized": "Immobilized",
    "reversed": "Reversed",
    "time_up": "Time Up",
    "pause": "Pause",
    "park": "Park",
}
"""What a status of the simulation trace is called in the metrics."""
PHASES = ("training", "evaluation")
BEST_MODEL_METRICS = ("progress", "reward", "laptime")
VERSION = 2.0

_KIND = 'a JSON object with the key "metrics", a list of rows'


class MetricsFileError(InputFileError):
    """A metrics file is missing, damaged, or of another kind."""


@dataclass(frozen=True)
class TrainingRow:
    """One episode of a training. Times in milliseconds of simulated time."""

    reward_score: int
    """Sum of the rewards, rounded."""
    metric_time: int
    """When the episode ended."""
    start_time: int
    """When it began."""
    elapsed_time_in_milliseconds: int
    episode: int
    """Counted from 1 over the whole training."""
    trial: int
    """Counted from 1 within the iteration."""
    phase: str
    """One of `PHASES`."""
    completion_percentage: int
    """Share of the lap, in percent, cut to a whole number."""
    episode_status: str
    """One of `STATUS_LABELS`."""


@dataclass(frozen=True)
class EvaluationRow:
    """One lap of an evaluation. Times in milliseconds of simulated time."""

    completion_percentage: int
    metric_time: int
    start_time: int
    elapsed_time_in_milliseconds: int
    episode_status: str
    crash_count: int
    immobilized_count: int
    off_track_count: int
    reversed_count: int
    reset_count: int
    """Sum of the four counts."""
    trial: int
    """Counted from 1."""


@dataclass(frozen=True)
class MetricsFile:
    """A metrics file that was read."""

    rows: tuple[TrainingRow, ...] | tuple[EvaluationRow, ...]
    best_model_metric: str | None = None
    """By what the best checkpoint was chosen; None in an evaluation's file."""


Row = TypeVar("Row", TrainingRow, EvaluationRow)


def training_row(
    *,
    reward: float,
    start_s: float,
    end_s: float,
    episode: int,
    trial: int,
    progress_share: float,
    status: str,
    phase: str = "training",
) -> TrainingRow:
    """Make the row of one episode.

    Args:
        reward: Sum of the episode's rewards.
        start_s: Simulated time at which it began.
        end_s: Simulated time at which it ended.
        episode: Its number over the whole training, counted from 1.
        trial: Its number within the iteration, counted from 1.
        progress_share: Share of the lap covered, 0 to 1.
        status: One of the words of `STATUS_LABELS`: "off_track".
        phase: "training" or "evaluation".
    """
    start_ms, end_ms = round(start_s * 1000), round(end_s * 1000)
    label, percent = STATUS_LABELS[status], _percent(progress_share)
    return TrainingRow(round(reward), end_ms, start_ms, end_ms - start_ms, episode, trial, phase, percent, label)


def evaluation_row(
    *,
    start_s: float,
    end_s: float,
    trial: int,
    progress_share: float,
    status: str,
    crashes: int = 0,
    immobilized: int = 0,
    off_track: int = 0,
    reversed_: int = 0,
) -> EvaluationRow:
    """Make the row of one lap of an evaluation; arguments as in `training_row`, and how often each mishap occurred."""
    start_ms, end_ms = round(start_s * 1000), round(end_s * 1000)
    return EvaluationRow(
        completion_percentage=_percent(progress_share),
        metric_time=end_ms,
        start_time=start_ms,
        elapsed_time_in_milliseconds=end_ms - start_ms,
        episode_status=STATUS_LABELS[status],
        crash_count=crashes,
        immobilized_count=immobilized,
        off_track_count=off_track,
        reversed_count=reversed_,
        reset_count=crashes + immobilized + off_track + reversed_,
        trial=trial,
    )


def write_training_metrics(path: str | Path, rows: Sequence[TrainingRow], best_model_metric: str = "progress") -> None:
    """Write the rows of a training, e.g. to `metrics/TrainingMetrics.json`.

    Raises:
        ContractError: `best_model_metric` is none of `BEST_MODEL_METRICS`.
        OutputFileError: The file cannot be written.
    """
    write_atomic(path, training_metrics_text([row_text(row) for row in rows], best_model_metric))


def row_text(row: TrainingRow) -> str:
    """Return the row as JSON."""
    return json.dumps(asdict(row))


def training_metrics_text(rows: Sequence[str], best_model_metric: str = "progress") -> str:
    """Return the file of a training from rows that are JSON already; who adds rows one by one need not print all anew.

    Raises:
        ContractError: `best_model_metric` is none of `BEST_MODEL_METRICS`.
    """
    if best_model_metric not in BEST_MODEL_METRICS:
        raise ContractError(
            "'{best_model_metric}' chooses no best model. {hint}",
            best_model_metric=best_model_metric,
            hint=nearest(best_model_metric, BEST_MODEL_METRICS),
        )
    tail = json.dumps({"version": VERSION, "best_model_metric": best_model_metric})[1:]
    return f'{{"metrics": [{", ".join(rows)}], {tail}'


def write_evaluation_metrics(path: str | Path, rows: Sequence[EvaluationRow]) -> None:
    """Write the rows of an evaluation, which carry no version, e.g. to `metrics/evaluation/evaluation-<14>.json`.

    Raises:
        OutputFileError: The file cannot be written.
    """
    write_atomic(path, json.dumps({"metrics": [asdict(row) for row in rows]}))


def read_metrics_file(path: str | Path) -> MetricsFile:
    """Read the metrics of a training or of an evaluation; the rows tell which it is.

    Raises:
        MetricsFileError: The file is missing or no JSON, or a row lacks a value or holds one of the wrong type.
    """
    document = read_json(path, MetricsFileError, _KIND)
    rows = document.value.get("metrics") if isinstance(document.value, dict) else None
    if not isinstance(rows, list):
        raise MetricsFileError(path, "there are no metrics", _KIND, line=1)
    if any(isinstance(row, dict) and "phase" in row for row in rows) or "best_model_metric" in document.value:
        metric = document.value.get("best_model_metric", "progress")
        return MetricsFile(tuple(_row(document, TrainingRow, place) for place in range(len(rows))), str(metric))
    return MetricsFile(tuple(_row(document, EvaluationRow, place) for place in range(len(rows))))


def _row(document: JsonDocument, kind: type[Row], place: int) -> Row:
    row = document.value["metrics"][place]
    if not isinstance(row, dict):
        raise document.error_at("metrics", place, found=repr(row), expected="an object")
    values: dict[str, Any] = {}
    for part in fields(kind):
        whole = part.type == "int"
        value = row.get(part.name)
        is_whole = type(value) is int or (type(value) is float and value.is_integer())
        if not (is_whole if whole else isinstance(value, str)):
            found = "there is no such value" if value is None else repr(value)
            raise document.error_at(
                "metrics", place, part.name, found=found, expected="a whole number" if whole else "a word"
            )
        values[part.name] = int(value) if whole else value  # type: ignore[arg-type]
    return kind(**values)


def _percent(share: float) -> int:
    """Return whole percent, cut, as AWS does; a hair below a finished lap through rounding is a finished lap."""
    return int(share * 100 + 1e-9)
