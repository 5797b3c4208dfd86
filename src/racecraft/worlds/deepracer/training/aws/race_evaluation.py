"""What a judged race leaves for AWS's own tools: every tick as a trace, pauses in it, every trial as a row of metrics.

Each trial is an episode of the trace. In a continuous race the car does not stop between them: steps and clock run on,
and the last row alone is done (source: a DeepRacer for Cloud evaluation of 2022; facts: deepracer.md 5.6, 9.1, 9.3).
"""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.evaluation.trial_race import RaceRecord, RaceTrial
from racecraft.worlds.deepracer.files.training_metrics import EvaluationRow, evaluation_row
from racecraft.worlds.deepracer.training.aws.evaluation_files import evaluation_trace, write_evaluation_files


def write_aws_race(
    folder: str | Path, record: RaceRecord, track_length_m: float, moment: datetime.datetime | None = None
) -> str:
    """Write a judged race into a run folder; return the fourteen digits under which it stands.

    Args:
        folder: The run folder.
        record: The race.
        track_length_m: Length of the centre line.
        moment: When it began, UTC; None: now.

    Raises:
        OutputFileError: The folder cannot be written.
    """
    stops = _stops(record)
    trace = evaluation_trace(
        record.ticks,
        episode=np.searchsorted([one.end for one in record.trials], np.arange(len(record.ticks))),
        done=stops,
        status=_statuses(record),
        track_length_m=track_length_m,
        pause_s=record.pause_seconds,
    )
    return write_evaluation_files(folder, trace, [_row(one, record) for one in record.trials], moment)


def _row(trial: RaceTrial, record: RaceRecord) -> EvaluationRow:
    return evaluation_row(
        start_s=trial.begin / TICKS_PER_SECOND,
        end_s=(trial.end + 1) / TICKS_PER_SECOND,
        trial=trial.trial,
        progress_share=trial.progress_percent / 100.0,
        status=str(_statuses(record)[trial.end]),
        crashes=trial.crash_count,
        immobilized=trial.immobilized_count,
        off_track=trial.off_track_count,
        reversed_=trial.reversed_count,
    )


def _stops(record: RaceRecord) -> Array:
    """Return the ticks at which the original's episode ends: a lap that flies on is none, nor is one with a reset."""
    ends = np.array([one.end for one in record.trials])
    stops = np.zeros(len(record.ticks), bool)
    stops[ends] = True
    flies_on = ends[(record.status[ends] == "lap_complete") & ~record.ticks["terminated"][ends]]
    stops[flies_on] = False
    return stops


def _statuses(record: RaceRecord) -> Array:
    """Return how each tick stands, in AWS's words: a lap that flies on is still in progress there."""
    words = record.status.astype(object)
    words[(words == "lap_complete") & ~_stops(record)] = "in_progress"
    return words
