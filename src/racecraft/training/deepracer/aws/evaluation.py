"""What an evaluation leaves for AWS's own tools: every tick as a trace, every lap as a row of metrics.

Laps are episodes from 0, on a virtual clock of 15 ticks a second. As at AWS, a lap that ends flying is still "in
progress" there, and only where the car stops at its end "lap complete"; its progress is 100 in both.
"""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np

from racecraft.contract.world import Array
from racecraft.envs.deepracer import race
from racecraft.envs.deepracer.vehicle import TICKS_PER_SECOND
from racecraft.formats.aws.model_folder import AwsModelFolder
from racecraft.formats.aws.sim_trace import trace_from_episodes, write_sim_trace
from racecraft.formats.aws.training_metrics import EvaluationRow, evaluation_row, write_evaluation_metrics
from racecraft.formats.whole import make_folder


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
    place = AwsModelFolder(Path(folder))
    stamp = place.free_stamp(moment or datetime.datetime.now(datetime.UTC))
    stopped = ticks["terminated"] | ticks["truncated"]
    ends = np.flatnonzero(stopped | (ticks["status"] == race.LAP_COMPLETE))[:laps]
    ticks, stopped = ticks[: ends[-1] + 1], stopped[: ends[-1] + 1]
    statuses = _statuses(ticks, stopped)
    rows = [_row(trial, first, last, ticks, statuses) for trial, (first, last) in enumerate(_spans(ends), 1)]
    trace = _trace(ticks, statuses, stopped, np.diff(ends, prepend=-1), track_length_m)
    for path in (place.evaluation_trace(stamp), place.evaluation_metrics(stamp)):
        make_folder(path.parent)
    write_sim_trace(place.evaluation_trace(stamp), trace)
    write_evaluation_metrics(place.evaluation_metrics(stamp), rows)
    return stamp


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


def _trace(ticks: Array, statuses: Array, stopped: Array, lengths: Array, track_length_m: float) -> dict[str, Array]:
    trace = trace_from_episodes(
        {
            "episode": np.repeat(np.arange(len(lengths)), lengths),
            "tick": ticks["steps"],
            "time_s": np.round(np.arange(1, len(ticks) + 1) / TICKS_PER_SECOND, 6),
            "x_m": ticks["front_x"],
            "y_m": ticks["front_y"],
            "yaw_rad": ticks["yaw"],
            "steering_rad": ticks["steering"],
            "speed_mps": ticks["speed"],
            "action": ticks["action"],
            "reward": np.zeros(len(ticks)),
            "done": stopped,
            "status": statuses.astype(str),
            "all_wheels_on_track": ticks["all_wheels_on"],
            "progress_share": ticks["progress"] / 100,
            "closest_waypoint": ticks["waypoint_nearest"],
            "track_length_m": np.full(len(ticks), track_length_m),
            "obstacle_crashes": (statuses == "crashed").astype(np.int32),
        }
    )
    del trace["wall_clock"]
    return trace
