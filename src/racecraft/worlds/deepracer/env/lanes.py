"""The rails that bots drive on: a periodic cubic spline through the middle of each lane. Begin with `lane_splines`.

A spline runs over the arc of the centre line: its knots are the waypoints, its points lie half way from them to the
nearest point of a border (facts 6.2). On an open track it ends without curvature instead of closing.
"""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.objects import LANE
from racecraft.worlds.deepracer.tracks.track import Track

SAME_KNOT_M = 1e-9
"""Waypoints nearer than this along the line are one knot: some route files repeat a row."""


def lane_splines(track: Track) -> tuple[Array, Array]:
    """Return knots (R,) m along the centre line, and cubics (2, R - 1, 2, 4) of the right and the left lane.

    In piece i, x and y are a + b t + c t² + d t³ of t = arc - knots[i], the four numbers in this order.
    """
    rows = np.concatenate([[True], np.diff(track.arc) > SAME_KNOT_M])
    knots = np.ascontiguousarray(track.arc[rows])
    centre = track.centre[rows]
    place = track.locate(centre)
    inner = centre + LANE * (place.inner_point - centre)
    outer = centre + LANE * (place.outer_point - centre)
    right, left = (outer, inner) if track.is_ccw else (inner, outer)
    return knots, np.ascontiguousarray([cubic_spline(knots, lane, track.closed) for lane in (right, left)])


def cubic_spline(knots: Array, points: Array, closed: bool) -> Array:
    """Return the cubics (R - 1, D, 4) of the spline through points (R, D) at knots (R,).

    Args:
        knots: Ascending.
        points: A closed spline's last point is its first.
        closed: Whether slope and curvature run on over the seam; else both ends have no curvature.
    """
    step = np.diff(knots)
    rise = np.diff(points, axis=0) / step[:, None]
    count = len(step) if closed else len(knots)
    matrix, right = np.zeros((count, count)), np.zeros((count, points.shape[1]))
    for i in range(count):  # second derivatives m: h₋ m₋ + 2 (h₋ + h) m + h m₊ = 6 (rise - rise₋)
        if not closed and i in (0, count - 1):
            matrix[i, i] = 1.0
            continue
        matrix[i, i - 1] += step[i - 1]
        matrix[i, i] += 2.0 * (step[i - 1] + step[i])
        matrix[i, (i + 1) % count] += step[i]
        right[i] = 6.0 * (rise[i] - rise[i - 1])
    bend = np.linalg.solve(matrix, right)
    if closed:
        bend = np.concatenate([bend, bend[:1]])
    slope = rise - step[:, None] * (2.0 * bend[:-1] + bend[1:]) / 6.0
    return np.stack([points[:-1], slope, bend[:-1] / 2.0, np.diff(bend, axis=0) / (6.0 * step[:, None])], axis=-1)
