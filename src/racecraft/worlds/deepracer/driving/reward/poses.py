"""From poses and commands to the rows that a reward function is asked about. Begin with `reports_of`.

Everything that a row holds beside pose and command is worked out on the track by the kernels that the world drives on,
so a lap of a log and a lap of ours are paid alike.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.race import IN_PROGRESS, LAP_COMPLETE, OFF_TRACK, TICK_REPORT
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M, TICK_SECONDS
from racecraft.worlds.deepracer.evaluation.kernels.replay import count_wheels, recompute_progress
from racecraft.worlds.deepracer.files.reward_analysis import FIRST_STEPS
from racecraft.worlds.deepracer.tracks.track import Track

X, Y, YAW, STEERING, SPEED = range(5)
"""Columns of a drive: base_link x, y (m), yaw (rad), commanded steering (rad, positive left) and speed (m/s)."""


def reports_of(track: Track, drive: Array, start_share: float = 0.0, laps: bool = True) -> Array:
    """Return what is written down of every tick of a drive, TICK_REPORT (T,).

    Args:
        track: The circuit, in driving direction.
        drive: (T, 5), columns as above; the first row is the first that is paid.
        start_share: Where the episode began, share of the lap; progress counts from there.
        laps: Whether a row at 100 per cent of progress counts as a completed lap.
    """
    drive = np.asarray(drive, np.float64)
    rows = np.zeros(len(drive), TICK_REPORT)
    for name, column in (("x", X), ("y", Y), ("yaw", YAW), ("steering", STEERING), ("speed", SPEED)):
        rows[name] = drive[:, column]
    rows["driven_speed"], rows["driven_steering"] = rows["speed"], rows["steering"]
    rows["front_x"] = rows["x"] + FRONT_POINT_M * np.cos(rows["yaw"])
    rows["front_y"] = rows["y"] + FRONT_POINT_M * np.sin(rows["yaw"])
    locate_rows(track, rows)
    begins = np.zeros(len(rows), bool)
    begins[:1] = True
    recompute_progress(rows["arc"] / track.length, begins, np.full(len(rows), start_share), rows["progress"])
    rows["steps"] = FIRST_STEPS + np.arange(len(rows))
    rows["time"] = rows["steps"] * TICK_SECONDS
    rows["action"], rows["object_hit"], rows["start_share"] = -1, -1, start_share
    rows["status"] = np.where(rows["is_off"], OFF_TRACK, IN_PROGRESS)
    if laps:
        rows["status"][rows["progress"] >= 100.0] = LAP_COMPLETE
    return rows


def one_tick_behind(drive: Array) -> Array:
    """Return where cars (T, 5) that drive as fast as they are commanded stood one tick before, heading as now."""
    before = drive.copy()
    metres = drive[:, SPEED] * TICK_SECONDS
    before[:, [X, Y]] -= metres[:, None] * np.column_stack([np.cos(drive[:, YAW]), np.sin(drive[:, YAW])])
    return before


def locate_rows(track: Track, rows: Array) -> None:
    """Fill what of TICK_REPORT rows follows from the pose and the front point: place along the track, wheels, side."""
    found = track.locate(np.column_stack([rows["front_x"], rows["front_y"]]))
    rows["arc"], rows["centre_distance"], rows["track_width"] = found.arc, found.distance, found.width
    rows["waypoint_before"], rows["waypoint_after"] = found.previous_waypoint, found.next_waypoint
    rows["waypoint_nearest"], rows["is_left"] = found.nearer_waypoint, found.is_left
    wheels = np.empty(len(rows), np.int64)
    count_wheels(track.arrays(), np.column_stack([rows["x"], rows["y"], rows["yaw"]]), wheels)
    rows["all_wheels_on"], rows["is_off"] = wheels == 4, wheels == 0


def place_on_road(
    track: Track, arcs: ArrayLike, offsets: ArrayLike, heading_errors: ArrayLike, steering: ArrayLike, speed: ArrayLike
) -> Array:
    """Return the drive (T, 5) whose front points stand at places of the road.

    Args:
        track: The circuit, in driving direction.
        arcs: (T,) m along the centre line.
        offsets: (T,) m from the centre line, left positive.
        heading_errors: (T,) rad between the car and the road, positive where the car looks further left.
        steering: Commanded angle, rad, positive left.
        speed: Commanded speed, m/s.
    """
    poses = np.array([track.pose_at(arc) for arc in np.asarray(arcs, float)])
    yaw = (poses[:, 2] + np.asarray(heading_errors) + np.pi) % (2.0 * np.pi) - np.pi
    front = poses[:, :2] + np.asarray(offsets)[:, None] * np.column_stack([-np.sin(poses[:, 2]), np.cos(poses[:, 2])])
    base = front - FRONT_POINT_M * np.column_stack([np.cos(yaw), np.sin(yaw)])
    commands = (np.broadcast_to(steering, len(poses)), np.broadcast_to(speed, len(poses)))
    return np.column_stack([base, yaw, *commands])
