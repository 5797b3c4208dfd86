"""Where a car is on its circuit: along the line, by what share of the lap, with which wheels on the road."""

from __future__ import annotations

import math

from racecraft.kernels import kernel
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M, FRONT_WHEELS_M, REAR_WHEELS_M
from racecraft.worlds.deepracer.tracks.kernels.geometry import is_on_road, locate_point, waypoints_around

REAR_X, REAR_Y = REAR_WHEELS_M
FRONT_X, FRONT_Y = FRONT_WHEELS_M
JUMP_M = 1.0
"""No car gains so much of the centre line in a tick by driving: 4 m/s are 0.27 m."""


@kernel
def locate(track, car):
    """Write down where the car now lies, and count falling progress."""
    cos, sin = math.cos(car.yaw), math.sin(car.yaw)
    x, y = car.x + cos * FRONT_POINT_M, car.y + sin * FRONT_POINT_M
    arc, distance, _, _, ix, iy, ox, oy = locate_point(track, x, y)
    before, after = waypoints_around(track.arc, arc)
    car.front_x, car.front_y, car.arc, car.centre_distance = x, y, arc, distance
    car.waypoint_before, car.waypoint_after = before, after
    car.border_inner, car.border_outer = math.hypot(x - ix, y - iy), math.hypot(x - ox, y - oy)
    car.track_width = math.hypot(ix - ox, iy - oy)
    car.wheels_on = wheels_on_road(track, car.x, car.y, cos, sin)
    car.last_progress = car.progress
    if track.closed:
        car.progress = progress_percent(arc / track.length, car.start_share, car.last_progress)
    else:
        car.progress = 100.0 * max(0.0, arc / track.length - car.start_share) / (1.0 - car.start_share)
    falling = car.progress < car.last_progress and not car.preparing
    car.backward_ticks = car.backward_ticks + 1 if falling else 0


@kernel
def undo_jump(track, car):
    """Leave the progress of a car off the road as it was where another stretch of the road is nearer to it now."""
    gained = (car.progress - car.last_progress) / 100.0 * track.length
    if car.wheels_on == 0 and abs(gained) > JUMP_M:
        car.progress = car.last_progress


@kernel
def progress_percent(lap_share, start_share, last_progress):
    """Return the share of the lap covered since the start, per cent (facts 3.3; simapp `agent_ctrl/utils.py`).

    The jump at the start line is undone by looking at the tick before; never more than 100.
    """
    progress = 100.0 * (lap_share - start_share)
    if progress <= 0.0:
        progress += 100.0
    if last_progress > progress + 50.0:
        progress += 100.0
    if progress > last_progress + 50.0:
        progress -= 100.0
    return min(progress, 100.0)


@kernel
def wheels_on_road(track, x, y, cos, sin):
    """Return how many of the four wheel centres lie strictly inside the road."""
    count = 0
    for ahead, left in ((REAR_X, REAR_Y), (FRONT_X, FRONT_Y), (REAR_X, -REAR_Y), (FRONT_X, -FRONT_Y)):
        if is_on_road(track, x + cos * ahead - sin * left, y + sin * ahead + cos * left):
            count += 1
    return count
