"""What a judged race leaves for AWS's own tools: every tick as a trace, pauses in it, every trial as a row of metrics.

A continuous race is one episode in the trace, others one a trial (facts: deepracer.md 5.6, 9.1, 9.3).
"""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np

from racecraft.contract.world import Array
from racecraft.envs.deepracer.vehicle import TICKS_PER_SECOND
from racecraft.evaluation.deepracer.judged_race import RaceRecord, Trial
from racecraft.formats.aws.model_folder import AwsModelFolder
from racecraft.formats.aws.sim_trace import trace_from_episodes, write_sim_trace
from racecraft.formats.aws.training_metrics import EvaluationRow, evaluation_row, write_evaluation_metrics
from racecraft.formats.whole import make_folder


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
    place = AwsModelFolder(Path(folder))
    stamp = place.free_stamp(moment or datetime.datetime.now(datetime.UTC))
    for path in (place.evaluation_trace(stamp), place.evaluation_metrics(stamp)):
        make_folder(path.parent)
    write_sim_trace(place.evaluation_trace(stamp), _trace(record, track_length_m))
    write_evaluation_metrics(place.evaluation_metrics(stamp), [_row(one, record) for one in record.trials])
    return stamp


def _row(trial: Trial, record: RaceRecord) -> EvaluationRow:
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


def _trace(record: RaceRecord, track_length_m: float) -> dict[str, Array]:
    ticks, stops = record.ticks, _stops(record)
    trace = trace_from_episodes(
        {
            "episode": np.concatenate([[0], np.cumsum(stops)[:-1]]),
            "tick": ticks["steps"],
            "time_s": np.round(np.arange(1, len(ticks) + 1) / TICKS_PER_SECOND, 6),
            "x_m": ticks["front_x"],
            "y_m": ticks["front_y"],
            "yaw_rad": ticks["yaw"],
            "steering_rad": ticks["steering"],
            "speed_mps": ticks["speed"],
            "action": ticks["action"],
            "reward": np.zeros(len(ticks)),
            "done": stops,
            "status": _statuses(record).astype(str),
            "all_wheels_on_track": ticks["all_wheels_on"],
            "progress_share": ticks["progress"] / 100,
            "closest_waypoint": ticks["waypoint_nearest"],
            "track_length_m": np.full(len(ticks), track_length_m),
            "pause_s": record.pause_seconds,
        }
    )
    del trace["wall_clock"]
    return trace
