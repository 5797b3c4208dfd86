"""What a race of cars against each other leaves for AWS's own tools, car by car. Begin with `write_aws_heads`.

The original judges HEAD_TO_MODEL as it judges one car: every model has a metrics file and a trace of its own, below its
own prefix, with a row a lap; mishaps are counted in the lap in which they happened (facts: deepracer.md 5.6, 6.3, 9.3).
A car never stops between laps, so its trace is one episode a lap with the last tick alone done.
"""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS, TICKS_PER_SECOND
from racecraft.worlds.deepracer.files.training_metrics import EvaluationRow, evaluation_row
from racecraft.worlds.deepracer.training.aws.evaluation_files import evaluation_trace, write_evaluation_files


def write_aws_heads(
    folder: str | Path, ticks: Array, track_length_m: float, moment: datetime.datetime | None = None
) -> str:
    """Write what one car did in a race into its run folder; return the fourteen digits under which it stands.

    Args:
        folder: The car's run folder.
        ticks: TICK_REPORT (T,) of the car, as `RaceResult.ticks` has it of one race; T at least 1.
        track_length_m: Length of the centre line.
        moment: When the race began, UTC; None: now.

    Raises:
        OutputFileError: The folder cannot be written.
    """
    parked = np.flatnonzero(ticks["status"] == race.PARK)
    ticks = ticks[: parked[0]] if len(parked) else ticks
    done = np.zeros(len(ticks), bool)
    done[-1] = True
    status = np.array(race.STATUSES, object)[ticks["status"]]
    status[(status == "lap_complete") & ~done] = "in_progress"  # as the original calls a lap that flies on
    if ticks["truncated"][-1] and status[-1] == "in_progress":
        status[-1] = "time_up"
    lap = laps_of(ticks)
    trace = evaluation_trace(
        ticks,
        episode=lap,
        done=done,
        status=status,
        track_length_m=track_length_m,
        pause_s=waits_of(ticks["status"] == race.PAUSE),
    )
    rows = [_row(ticks, status, np.flatnonzero(lap == one)) for one in range(int(lap[-1]) + 1)]
    return write_evaluation_files(folder, trace, rows, moment)


def laps_of(ticks: Array) -> Array:
    """Return the lap that each tick belongs to, counted from 0, (T,); the tick that completes one is still of it."""
    complete = ticks["status"] == race.LAP_COMPLETE
    laps: Array = np.cumsum(complete) - complete
    return laps


def waits_of(paused: Array) -> Array:
    """Return the seconds that a car still waits at each tick, this one included, of whether it waits (bool (T,))."""
    left = np.zeros(len(paused))
    still = 0
    for tick in range(len(paused) - 1, -1, -1):
        still = still + 1 if paused[tick] else 0
        left[tick] = still * TICK_SECONDS
    return left


def _row(ticks: Array, status: Array, own: Array) -> EvaluationRow:
    """Return a lap's row; `own` are the numbers of its ticks."""
    codes, last = ticks["status"][own], own[-1]
    is_lap = codes[-1] == race.LAP_COMPLETE
    progress = 1.0 if is_lap else min(max(float(ticks["progress"][last]) / 100.0, 0.0), 1.0)
    return evaluation_row(
        start_s=own[0] / TICKS_PER_SECOND,
        end_s=(last + 1) / TICKS_PER_SECOND,
        trial=int(ticks["laps"][last]) + (0 if is_lap else 1),
        progress_share=progress,
        status=str(status[last]),
        crashes=int(np.sum(codes == race.CRASHED)),
        immobilized=int(np.sum(codes == race.IMMOBILISED)),
        off_track=int(np.sum(codes == race.OFF_TRACK)),
        reversed_=int(np.sum(codes == race.REVERSED)),
    )
