"""A stadium whose every length is known, and laps driven round it at known speeds."""

import numpy as np
import polars as pl

from racecraft.worlds.deepracer.logs.columns import PHASES, TICK_COLUMNS, schema
from racecraft.worlds.deepracer.tracks.track import Track

STRAIGHT_M, RADIUS_M, HALF_WIDTH_M = 4.0, 1.0, 0.4
LENGTH_M = 2 * STRAIGHT_M + 2 * np.pi * RADIUS_M


def stadium(start_m=0.0, step_m=0.02):
    """Return the track, driven counter-clockwise; the start line lies in the middle of the lower straight."""
    arcs = np.append(np.arange(0.0, LENGTH_M, step_m), LENGTH_M) + start_m
    centre, normal = at(arcs % LENGTH_M)
    centre[-1], normal[-1] = centre[0], normal[0]
    rows = np.hstack([centre, centre + HALF_WIDTH_M * normal, centre - HALF_WIDTH_M * normal])
    return Track.from_rows("stadium", rows)


def at(arc):
    """Return points (T, 2) on the centre line and unit vectors to the left, arcs in m from the middle of a straight."""
    half, turn = STRAIGHT_M / 2, np.pi * RADIUS_M
    arc = np.asarray(arc, float)
    second = (arc - half) >= turn + half
    local = np.where(second, arc - STRAIGHT_M - turn, arc)  # the second half of the lap is the first, turned round
    angle = np.clip((local - half) / RADIUS_M, 0.0, np.pi)
    over = np.maximum(local - half - turn, 0.0)
    x = np.where(local <= half, local, half + RADIUS_M * np.sin(angle)) - over
    y = RADIUS_M * (1.0 - np.cos(angle)) - RADIUS_M
    heading = angle
    sign = np.where(second, -1.0, 1.0)
    points = np.column_stack([x * sign, y * sign])
    return points, np.column_stack([-np.sin(heading) * sign, np.cos(heading) * sign])


def drive(speed_of, begin_m=0.0, laps=1, tick=1 / 15, hold=True):
    """Return (arc m, time s) of a car that drives at `speed_of(arc)` m/s from a place on, whole laps, tick by tick."""
    fine = 1e-3
    metres = np.arange(0.0, laps * LENGTH_M + 0.5, fine)
    seconds = np.concatenate([[0.0], np.cumsum(fine / speed_of((begin_m + metres[:-1]) % LENGTH_M))])
    times = np.arange(0.0, seconds[-1], tick)
    return begin_m + np.interp(times, seconds, metres), times


def as_log(drives, phase="training", offset_m=0.0):
    """Return the table of ticks of several drives of one lap each, an episode a drive."""
    frames = []
    for episode, (arc, times) in enumerate(drives):
        whole = int(np.argmax(arc - arc[0] >= LENGTH_M - 1e-9))
        arc, times = arc[: whole + 1], times[: whole + 1]
        points, normal = at(arc % LENGTH_M)
        points = points + offset_m * normal
        count = len(arc)
        frames.append(
            pl.DataFrame({
                "round": np.ones(count), "phase": pl.Series([phase] * count, dtype=pl.Enum(PHASES)),
                "stream": [""] * count, "worker": np.zeros(count), "iteration": np.full(count, episode // 2),
                "episode": np.full(count, episode), "unique_episode": np.full(count, episode),
                "tick": np.arange(1, count + 1), "time_s": times + 100.0 * episode, "x_m": points[:, 0],
                "y_m": points[:, 1], "yaw_rad": np.zeros(count), "steering_rad": np.zeros(count),
                "speed_mps": np.full(count, 3.0), "action": np.full(count, episode), "reward": np.ones(count),
                "progress_share": np.minimum((arc - arc[0]) / LENGTH_M, 1.0),
                "status": ["prepare", *["in_progress"] * (count - 2), "lap_complete"],
                "closest_waypoint": np.zeros(count), "track_length_m": np.full(count, LENGTH_M),
            })
        )  # fmt: skip
    known = schema(TICK_COLUMNS)
    frame = pl.concat(frames)
    return frame.with_columns(pl.col(name).cast(known[name]) for name in frame.columns)
