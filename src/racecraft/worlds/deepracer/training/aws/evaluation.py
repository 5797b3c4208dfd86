"""What an evaluation leaves for AWS's own tools: every tick as a trace, every lap as a row of metrics.

Laps are episodes from 0, on a virtual clock of 15 ticks a second. As at AWS, a lap that ends flying is still "in
progress" there, and only where the car stops at its end "lap complete"; its progress is 100 in both.
"""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.files.training_metrics import EvaluationRow, evaluation_row
from racecraft.worlds.deepracer.training.aws.evaluation_files import evaluation_trace, write_evaluation_files


def write_aws_evaluation(
    folder: str | Path,
    ticks: Array,
    laps: int,
    track_length_m: float,
    moment: datetime.datetime | None = None,
) -> str:
    """Write one car's evaluation into its run folder.

    Args:
        folder: The run folder.
        ticks: TICK_REPORT (T,), what `DriveKeeper` keeps of `judge_laps`.
        laps: How many laps were judged; ticks after them are left out.
        track_length_m: Length of the centre line.
        moment: When it began, UTC; None: now.

    Returns:
        The fourteen digits under which it stands.

    Raises:
        OutputFileError: The folder cannot be written.
    """
    stopped = ticks["terminated"] | ticks["truncated"]
    ends = np.flatnonzero(stopped | (ticks["status"] == race.LAP_COMPLETE))[:laps]
    ticks, stopped = ticks[: ends[-1] + 1], stopped[: ends[-1] + 1]
    statuses = _statuses(ticks, stopped)
    rows = [_row(trial, first, last, ticks, statuses) for trial, (first, last) in enumerate(_spans(ends), 1)]
    trace = evaluation_trace(
        ticks,
        episode=np.repeat(np.arange(len(ends)), np.diff(ends, prepend=-1)),
        done=stopped,
        status=statuses,
        track_length_m=track_length_m,
    )
    return write_evaluation_files(folder, trace, rows, moment)


def _spans(ends: Array) -> list[tuple[int, int]]:
    """Return the first and the last tick of each lap."""
    return list(zip([0, *(ends[:-1] + 1).tolist()], ends.tolist(), strict=True))


def _statuses(ticks: Array, stopped: Array) -> Array:
    """Return how each tick stands, in AWS's words."""
    words = np.array(race.STATUSES)[ticks["status"]].astype(object)
    words[(words == "lap_complete") & ~stopped] = "in_progress"
    words[(words == "in_progress") & stopped] = "time_up"
    return words


def _row(trial: int, first: int, last: int, ticks: Array, statuses: Array) -> EvaluationRow:
    ended = statuses[last]
    return evaluation_row(
        start_s=first / TICKS_PER_SECOND,
        end_s=(last + 1) / TICKS_PER_SECOND,
        trial=trial,
        progress_share=float(ticks["progress"][last]) / 100,
        status=str(ended),
        immobilized=int(ended == "immobilized"),
        crashes=int(ended == "crashed"),
        off_track=int(ended == "off_track"),
        reversed_=int(ended == "reversed"),
    )
