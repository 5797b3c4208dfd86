"""What a recorded race says of itself, told again from its poses alone. Begin with `recompute`.

A trace holds, beside the pose of every row, what the original worked out from it: progress, the closest waypoint,
whether all wheels were on the track, whether the car was off it. Here the same is worked out by our own geometry, with
the very kernels the world drives on, and compared row by row.

Where an episode began is not written down; it is the start that most of its rows agree on. Where a route file repeats a
row, both ways to count it are tried: all logs of 2020 to 2026 that we know count it, the code of simapp 6.0.5 does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M
from racecraft.worlds.deepracer.evaluation.kernels.replay import count_wheels, recompute_progress
from racecraft.worlds.deepracer.files.sim_trace import SimTrace
from racecraft.worlds.deepracer.tracks.track import Track

PROGRESS_TOLERANCE = 0.01
"""Points of progress: a row that differs by more is a mismatch."""
SAME_START = 1e-4
"""Starts that differ by less than this share of the lap agree; traces copied from logs have four decimals."""
NOT_JUDGED = ("lap_complete", "crashed", "pause", "park", "prepare")
"""Statuses that say nothing of being off the track: they win over it, or the car is being held."""
HELD = ("pause", "park", "prepare")
"""Statuses of a car that is held in place."""


@dataclass(frozen=True, kw_only=True)
class TracePath:
    """Where a trace's car stood and what was done with it, on whatever track; arrays of shape (T,)."""

    poses: Array
    """(T, 3) base_link x, y in m and yaw in rad."""
    begins: Array
    """The row is its episode's first."""
    restarts: Array
    """The row is an episode's first, and the car stands there; a flying lap goes on from the one before."""
    held: Array
    """The car is held in place: prepare, pause, park."""


@dataclass(frozen=True, kw_only=True)
class RecomputedTrace(TracePath):
    """A trace and what we make of it; arrays of shape (T,), a mismatch is True."""

    reversed: Array
    """The episode was driven against the track's direction."""
    progress: Array
    """Per cent, by our geometry."""
    progress_wrong: Array
    waypoint_wrong: Array
    wheels_wrong: Array
    """Never where the car is held: while it is being put back, pose and wheels are not of one moment."""
    off_track_judged: Array
    """The row says whether the car was off the track; never without a column `episode_status`."""
    off_track_wrong: Array

    progress_far: Array
    """Our progress and the trace's are more than a point apart; nearly everywhere where the track is another one."""
    waypoints: str | None = None
    """How the trace counts a row that the route file repeats, "as_filed" or "distinct"; None where the file has none,
    or where both ways agree equally well."""


def trace_path(trace: SimTrace) -> TracePath:
    """Return what a trace says of its car's whereabouts, without asking a track."""
    begins = episode_begins(trace)
    known = "episode_status" in trace.columns
    held = np.isin(trace.columns["episode_status"], HELD) if known else begins & (trace.columns["steps"] <= 1)
    restarts = begins & (held | (trace.columns["steps"] <= 1))
    return TracePath(poses=places_of(trace), begins=begins, restarts=restarts, held=held)


def recompute(trace: SimTrace, track: Track) -> RecomputedTrace:
    """Return a trace's figures, worked out again from its poses.

    Args:
        trace: What was recorded.
        track: The circuit it was driven on.
    """
    columns = trace.columns
    walked = trace_path(trace)
    places, begins, held = walked.poses, walked.begins, walked.held
    status = columns.get("episode_status", np.full(len(trace), ""))
    progress, backwards, waypoints = _along(trace, track, begins)
    gap = np.abs(progress - columns["progress"])
    waypoint_wrong = waypoints != columns["closest_waypoint"]
    counting = None
    if track.repeated_rows:
        _, _, filed = _along(trace, track.as_filed(), begins)
        other = filed != columns["closest_waypoint"]
        if other.sum() != waypoint_wrong.sum():
            counting = "as_filed" if other.sum() < waypoint_wrong.sum() else "distinct"
        waypoint_wrong = other if counting == "as_filed" else waypoint_wrong
    wheels = np.empty(len(trace), np.int64)
    count_wheels(track.arrays(), places, wheels)
    judged = ~np.isin(status, NOT_JUDGED) & ("episode_status" in columns)
    return RecomputedTrace(
        poses=places,
        begins=begins,
        restarts=walked.restarts,
        held=held,
        reversed=backwards,
        progress=progress,
        progress_wrong=gap > PROGRESS_TOLERANCE,
        waypoint_wrong=waypoint_wrong,
        wheels_wrong=((wheels == 4) != columns["all_wheels_on_track"]) & ~held,
        off_track_judged=judged,
        off_track_wrong=judged & ((wheels == 0) != (status == "off_track")),
        progress_far=gap > 1.0,
        waypoints=counting,
    )


def places_of(trace: SimTrace) -> Array:
    """Return base_link x, y (m) and yaw (rad) of every row, (T, 3); the trace has the front point and degrees."""
    yaw = np.radians(trace.columns["yaw"])
    x = trace.columns["X"] - FRONT_POINT_M * np.cos(yaw)
    y = trace.columns["Y"] - FRONT_POINT_M * np.sin(yaw)
    return np.column_stack([x, y, yaw])


def episode_begins(trace: SimTrace) -> Array:
    """Tell which rows begin an episode, (T,) bool: another number, or steps that do not grow (another worker)."""
    episode, steps = trace.columns["episode"], trace.columns["steps"]
    begins = np.ones(len(trace), bool)
    begins[1:] = (np.diff(episode) != 0) | (np.diff(steps) <= 0)
    return begins


def _along(trace: SimTrace, track: Track, begins: Array) -> tuple[Array, Array, Array]:
    """Return progress, whether the episode was driven backwards, and the nearer waypoint; each (T,)."""
    progress, waypoints = _one_way(trace, track, begins)
    backwards = np.zeros(len(trace), bool)
    wrong = np.abs(progress - trace.columns["progress"]) > PROGRESS_TOLERANCE
    episode = np.cumsum(begins) - 1
    suspects = np.bincount(episode, wrong) > 0.5 * np.bincount(episode)
    if track.closed and suspects.any():
        other_progress, other_waypoints = _one_way(trace, track.reversed(), begins)
        far = np.abs(progress - trace.columns["progress"])
        other_far = np.abs(other_progress - trace.columns["progress"])
        better = np.bincount(episode, other_far) < 0.5 * np.bincount(episode, far)
        backwards = (suspects & better)[episode]
        progress = np.where(backwards, other_progress, progress)
        waypoints = np.where(backwards, other_waypoints, waypoints)
    return progress, backwards, waypoints


def _one_way(trace: SimTrace, track: Track, begins: Array) -> tuple[Array, Array]:
    found = track.locate(np.column_stack([trace.columns["X"], trace.columns["Y"]]))
    shares = found.arc / track.length
    starts = _agreed_starts(shares - trace.columns["progress"] / 100.0, begins)
    progress = np.empty(len(trace))
    recompute_progress(shares, begins, starts, progress)
    return progress, found.nearer_waypoint


def _agreed_starts(implied: Array, begins: Array) -> Array:
    """Return for every row the start that most rows of its episode imply, share of the lap, (T,)."""
    starts = np.empty(len(implied))
    edges = np.append(np.flatnonzero(begins), len(implied))
    for first, last in zip(edges[:-1], edges[1:], strict=True):
        # Around the circle: 0.9999 and 0.0001 are neighbours.
        around = np.sort(np.mod(implied[first:last], 1.0))
        around = np.concatenate([around, around + 1.0])
        upto = np.searchsorted(around, around[: last - first] + SAME_START, side="right")
        crowd = upto - np.arange(last - first)
        best = int(np.argmax(crowd))
        starts[first:last] = np.mod(around[best + (crowd[best] - 1) // 2], 1.0)
    return starts
