"""Where a car is on its circuit: along the line, by what share of the lap, with which wheels on the road."""

from __future__ import annotations

import math

from racecraft.kernels import kernel
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M, FRONT_WHEELS_M, REAR_WHEELS_M
from racecraft.worlds.deepracer.tracks.kernels.geometry import is_on_road, nearest_on_line, waypoints_around

REAR_X, REAR_Y = REAR_WHEELS_M
FRONT_X, FRONT_Y = FRONT_WHEELS_M
JUMP_M = 1.0
"""No car gains so much of the centre line in a tick by driving: 4 m/s are 0.27 m."""


@kernel
def locate(track, car, jumps=True):
    """Write down where the car now lies, and count falling progress.

    `jumps`: a car off the road lies on whatever stretch of it is nearest; otherwise on the one that it left.
    """
    cos, sin = math.cos(car.yaw), math.sin(car.yaw)
    x, y = car.x + cos * FRONT_POINT_M, car.y + sin * FRONT_POINT_M
    car.wheels_on = wheels_on_road(track, car.x, car.y, cos, sin)
    arc, distance, cx, cy = nearest_on_line(track.centre, track.arc, x, y)
    if not jumps and car.wheels_on == 0 and arc_between(track, arc, car.arc) > JUMP_M:
        arc, distance, cx, cy = nearest_on_stretch(track, car.arc, x, y)
    _, _, ix, iy = nearest_on_line(track.inner, track.inner_arc, cx, cy)
    _, _, ox, oy = nearest_on_line(track.outer, track.outer_arc, cx, cy)
    before, after = waypoints_around(track.arc, arc)
    car.front_x, car.front_y, car.arc, car.centre_distance = x, y, arc, distance
    car.waypoint_before, car.waypoint_after = before, after
    car.border_inner, car.border_outer = math.hypot(x - ix, y - iy), math.hypot(x - ox, y - oy)
    car.track_width = math.hypot(ix - ox, iy - oy)
    car.last_progress = car.progress
    if track.closed:
        car.progress = progress_percent(arc / track.length, car.start_share, car.last_progress)
    else:
        car.progress = 100.0 * max(0.0, arc / track.length - car.start_share) / (1.0 - car.start_share)
    falling = car.progress < car.last_progress and not car.preparing
    car.backward_ticks = car.backward_ticks + 1 if falling else 0


@kernel
def nearest_on_stretch(track, arc, x, y):
    """Return (arc, distance, x, y) of the centre point nearest to (x, y) on the stretch within JUMP_M of `arc`."""
    best = (arc, math.inf, x, y)
    for i in range(track.centre.shape[0] - 1):
        half = 0.5 * (track.arc[i + 1] - track.arc[i])
        if arc_between(track, track.arc[i] + half, arc) <= JUMP_M + half:
            place = nearest_on_line(track.centre[i : i + 2], track.arc[i : i + 2], x, y)
            if place[1] < best[1]:
                best = place
    return best


@kernel
def arc_between(track, arc, other):
    """Return how far two places are apart along the centre line, the shorter way round, m."""
    gap = abs(arc - other)
    return min(gap, track.length - gap) if track.closed else gap


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
