"""The two files of one judged drive, as AWS's own tools read them: a trace of every tick, a row of metrics a trial."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.atomic import make_folder
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.files.model_folder import AwsModelFolder
from racecraft.worlds.deepracer.files.sim_trace import trace_from_episodes, write_sim_trace
from racecraft.worlds.deepracer.files.training_metrics import EvaluationRow, write_evaluation_metrics


def write_evaluation_files(
    folder: str | Path, trace: dict[str, Array], rows: Sequence[EvaluationRow], moment: datetime.datetime | None = None
) -> str:
    """Write a judged drive into a run folder; return the fourteen digits under which it stands.

    Args:
        folder: The run folder.
        trace: `evaluation_trace`.
        rows: One a trial.
        moment: When it began, UTC; None: now.

    Raises:
        OutputFileError: The folder cannot be written.
    """
    place = AwsModelFolder(Path(folder))
    stamp = place.free_stamp(moment or datetime.datetime.now(datetime.UTC))
    for path in (place.evaluation_trace(stamp), place.evaluation_metrics(stamp)):
        make_folder(path.parent)
    write_sim_trace(place.evaluation_trace(stamp), trace)
    write_evaluation_metrics(place.evaluation_metrics(stamp), rows)
    return stamp


def evaluation_trace(
    ticks: Array,
    *,
    episode: Array,
    done: Array,
    status: Array,
    track_length_m: float,
    pause_s: Array | None = None,
) -> dict[str, Array]:
    """Return the trace of a drive on a virtual clock of 15 ticks a second; nothing is rewarded in it.

    Args:
        ticks: TICK_REPORT (T,).
        episode: Which episode each tick belongs to, counted from 0, (T,).
        done: The ticks at which the car stops, bool (T,).
        status: How each tick stands, in AWS's words, (T,).
        track_length_m: Length of the centre line.
        pause_s: What is left of a penalty at each tick, s, (T,); None: none.
    """
    trace = trace_from_episodes(
        {
            "episode": episode,
            "tick": ticks["steps"],
            "time_s": np.round(np.arange(1, len(ticks) + 1) / TICKS_PER_SECOND, 6),
            "x_m": ticks["front_x"],
            "y_m": ticks["front_y"],
            "yaw_rad": ticks["yaw"],
            "steering_rad": ticks["steering"],
            "speed_mps": ticks["speed"],
            "action": ticks["action"],
            "reward": np.zeros(len(ticks)),
            "done": done,
            "status": status.astype(str),
            "all_wheels_on_track": ticks["all_wheels_on"],
            "progress_share": ticks["progress"] / 100,
            "closest_waypoint": ticks["waypoint_nearest"],
            "track_length_m": np.full(len(ticks), track_length_m),
            "obstacle_crashes": _count_since_stop(status == "crashed", done),
            **({} if pause_s is None else {"pause_s": pause_s}),
        }
    )
    del trace["wall_clock"]
    return trace


def _count_since_stop(happened: Array, stops: Array) -> Array:
    """Return how often something happened since the car last stopped, this tick included, int32 (T,)."""
    drive = np.concatenate([[0], np.cumsum(stops)[:-1]])
    so_far = np.cumsum(happened)
    before = np.concatenate([[0], so_far])[np.searchsorted(drive, drive)]
    return (so_far - before).astype(np.int32)
