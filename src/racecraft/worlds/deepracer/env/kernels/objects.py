"""Boxes on the road, in compiled scalar code: do two touch, which is hit, which are near. Begin at `rectangles_touch`.

A box is a row of `Objects.boxes`: x, y, yaw, half length, half width, height.
"""

from __future__ import annotations

import math

from racecraft.kernels import kernel
from racecraft.worlds.deepracer.env.vehicle import BODY_HALF_LENGTH_M, BODY_HALF_WIDTH_M
from racecraft.worlds.deepracer.tracks.kernels.geometry import is_left_of_centre, locate_point

CORNER_BUFFER_M = 0.05
"""How much larger on each side the original takes a box when it asks for a car's corners (facts 3.5)."""


@kernel
def rectangles_touch(ax, ay, a_yaw, a_length, a_width, bx, by, b_yaw, b_length, b_width):
    """Tell whether two rectangles share a point; lengths and widths are halves, m, yaws rad.

    Two convex shapes are apart where a line along a side of one of them keeps them apart: four directions to try.
    """
    dx, dy = bx - ax, by - ay
    a_cos, a_sin = math.cos(a_yaw), math.sin(a_yaw)
    b_cos, b_sin = math.cos(b_yaw), math.sin(b_yaw)
    along = abs(a_cos * b_cos + a_sin * b_sin)
    across = abs(a_cos * b_sin - a_sin * b_cos)
    return (
        abs(dx * a_cos + dy * a_sin) <= a_length + b_length * along + b_width * across
        and abs(dy * a_cos - dx * a_sin) <= a_width + b_length * across + b_width * along
        and abs(dx * b_cos + dy * b_sin) <= b_length + a_length * along + a_width * across
        and abs(dy * b_cos - dx * b_sin) <= b_width + a_length * across + a_width * along
    )


@kernel
def corner_inside(ax, ay, a_yaw, a_length, a_width, bx, by, b_yaw, b_length, b_width):
    """Tell whether a corner of rectangle a lies in rectangle b, which is all that the original asks (facts 3.5)."""
    a_cos, a_sin = math.cos(a_yaw), math.sin(a_yaw)
    b_cos, b_sin = math.cos(b_yaw), math.sin(b_yaw)
    for ahead in (-a_length, a_length):
        for left in (-a_width, a_width):
            dx = ax + ahead * a_cos - left * a_sin - bx
            dy = ay + ahead * a_sin + left * a_cos - by
            if abs(dx * b_cos + dy * b_sin) <= b_length and abs(dy * b_cos - dx * b_sin) <= b_width:
                return True
    return False


@kernel
def car_touches(x, y, yaw, margin, box):
    """Tell whether a car at a pose of base_link comes within `margin` m of a box, side to side."""
    return rectangles_touch(
        x, y, yaw, BODY_HALF_LENGTH_M + margin, BODY_HALF_WIDTH_M + margin, box[0], box[1], box[2], box[3], box[4]
    )


@kernel
def hits(plan, boxes, states, k, x, y, yaw):
    """Tell whether a car at a pose of base_link hits the k-th box around it; a car that waits is let through."""
    box, is_car = boxes[k], k >= plan.kinds.shape[0]
    if is_car and states[k].pause > 0.0:
        return False
    if not plan.corners_only:
        return car_touches(x, y, yaw, 0.0, box)
    length, width = box[3], box[4]
    if plan.speed == 0.0 and not is_car:
        length, width = length + CORNER_BUFFER_M, width + CORNER_BUFFER_M
    return corner_inside(x, y, yaw, BODY_HALF_LENGTH_M, BODY_HALF_WIDTH_M, box[0], box[1], box[2], length, width)


@kernel
def objects_around(states, arc, length):
    """Return the objects (previous, next) along the centre line of a lap, as `closest_objects` names them.

    Both are 0 without objects, and the same where there is one. An object level with the car is the previous one.
    """
    before, after = 0, 0
    gap_before, gap_after = math.inf, math.inf
    for k in range(states.shape[0]):
        behind = (arc - states[k].arc) % length
        ahead = length - behind
        if behind < gap_before:
            before, gap_before = k, behind
        if ahead < gap_after:
            after, gap_after = k, ahead
    return before, after


@kernel
def object_near(states, arc, length, gap):
    """Return the first object within `gap` m of a place along the lap, or -1."""
    for k in range(states.shape[0]):
        ahead = (states[k].arc - arc) % length
        if min(ahead, length - ahead) < gap:
            return k
    return -1


@kernel
def is_to_blame(plan, states, k, arc, length):
    """Tell whether a car at `arc` m along the lap ran into the k-th object around it, and not the object into it.

    What stands is never to blame; of two that drive, the one behind is. Of two cars that are level, both are.
    """
    is_car = k >= plan.kinds.shape[0]
    if plan.speed == 0.0 and not is_car:
        return True
    other = states[k].driven if is_car else states[k].arc  # two cars are compared nose by nose
    if plan.blames_by_lap:
        return arc < other
    return (other - arc) % length < 0.5 * length


@kernel
def note_place(track, box, state):
    """Write down what a reward is told of where an object stands."""
    arc, distance, _, _, ix, iy, ox, oy = locate_point(track, box[0], box[1])
    state.arc, state.centre_distance = arc, distance
    state.is_left = is_left_of_centre(track, box[0], box[1], ix, iy, ox, oy)
