"""Where a point lies along a circuit, in compiled scalar code. Begin with `locate_point`.

Every body takes plain arrays and numbers, allocates nothing, and may be called from another kernel inside a `prange`.
Lines are (K, 2) float64, row after row, with `arc` (K,) their running length; a loop's last row repeats its first.
All lengths are metres, angles radians, left positive.

The arithmetic follows GEOS, which the original simulator asks through Shapely, down to the order of the sums, so that
progress agrees with recorded races to the last digits (facts: simapp `track_data.py`, `track_geom/utils.py`).
"""

from __future__ import annotations

import math

from racecraft.kernels import kernel, lean_kernel


@kernel
def nearest_on_line(line, arc, x, y):
    """Return (arc, distance, x, y) of the point of a line nearest to (x, y); of equals, the first along the line."""
    best, row, share, length = math.inf, 0, 0.0, 0.0
    for i in range(line.shape[0] - 1):
        ax, ay = line[i, 0], line[i, 1]
        dx, dy = line[i + 1, 0] - ax, line[i + 1, 1] - ay
        px, py = x - ax, y - ay
        squared = dx * dx + dy * dy
        r = (px * dx + py * dy) / squared if squared > 0.0 else 0.0
        r = min(max(r, 0.0), 1.0)
        ex, ey = px - r * dx, py - r * dy
        gap = ex * ex + ey * ey
        if gap < best:
            best, row, share, length = gap, i, r, math.sqrt(squared)
    s = arc[row] + share * length
    nx = line[row, 0] + share * (line[row + 1, 0] - line[row, 0])
    ny = line[row, 1] + share * (line[row + 1, 1] - line[row, 1])
    return s, math.sqrt(best), nx, ny


@kernel
def row_after(arc, s):
    """Return the first row whose arc is beyond `s`, 1 to K; K means that `s` is the line's end."""
    low, high = 0, arc.shape[0]
    while low < high:
        middle = (low + high) // 2
        if s < arc[middle]:
            high = middle
        else:
            low = middle + 1
    return low


@kernel
def waypoints_around(arc, s):
    """Return the waypoints (previous, next) around arc `s`, as `closest_waypoints` gives them: 0 to K-1.

    At a loop's very end the pair is (K-1, 0). (Facts: simapp `track_geom/utils.py`.)
    """
    rows = arc.shape[0]
    after = row_after(arc, s)
    before = after - 1 if after > 0 else rows - 1
    return before, (after if after < rows else 0)


@kernel
def point_at(line, arc, s):
    """Return (x, y, row) of the point at arc `s`, held within the line; `row` is the row before it, 0 to K-2."""
    row = min(max(row_after(arc, s) - 1, 0), line.shape[0] - 2)
    step = math.sqrt((line[row + 1, 0] - line[row, 0]) ** 2 + (line[row + 1, 1] - line[row, 1]) ** 2)
    share = min(max((s - arc[row]) / step, 0.0), 1.0) if step > 0.0 else 0.0
    return (
        line[row, 0] + share * (line[row + 1, 0] - line[row, 0]),
        line[row, 1] + share * (line[row + 1, 1] - line[row, 1]),
        row,
    )


@kernel
def pose_on_line(line, arc, closed, s):
    """Return (x, y, yaw) at arc `s`: yaw looks from the point to the next waypoint (forward difference).

    On a loop `s` wraps; on an open line it is held within 0 and the length.
    """
    if closed:
        s = s % arc[arc.shape[0] - 1]
    x, y, row = point_at(line, arc, s)
    dx, dy = line[row + 1, 0] - x, line[row + 1, 1] - y
    if dx == 0.0 and dy == 0.0:
        dx, dy = line[row + 1, 0] - line[row, 0], line[row + 1, 1] - line[row, 1]
    return x, y, math.atan2(dy, dx)


@kernel
def central_yaw_on_line(line, arc, closed, s):
    """Return the yaw at arc `s` as obstacles get it: from the waypoint before to the waypoint after."""
    if closed:
        s = s % arc[arc.shape[0] - 1]
    _, _, row = point_at(line, arc, s)
    return math.atan2(line[row + 1, 1] - line[row, 1], line[row + 1, 0] - line[row, 0])


@lean_kernel
def side_of_ring(ring, x, y):
    """Return 1 inside a ring, -1 outside, 0 on it. A ring is (R, 2), its last row repeats its first; empty: outside."""
    inside = False
    for i in range(ring.shape[0] - 1):
        ax, ay = ring[i, 0], ring[i, 1]
        bx, by = ring[i + 1, 0], ring[i + 1, 1]
        if (ay > y) == (by > y):
            # Level with the point on one side only; on the ring if it touches an end or lies on a level edge.
            if (ax == x and ay == y) or (bx == x and by == y):
                return 0
            if ay == y and by == y and min(ax, bx) <= x <= max(ax, bx):
                return 0
            continue
        if ax == x and ay == y or bx == x and by == y:
            return 0
        turn = (bx - ax) * (y - ay) - (x - ax) * (by - ay)
        if turn == 0.0:
            return 0
        if (turn > 0.0) == (by > ay):
            inside = not inside
    return 1 if inside else -1


@lean_kernel
def is_on_road(track, x, y):
    """Tell whether (x, y) is strictly inside the road; a border is outside (facts: simapp, polygon `contains`)."""
    return side_of_ring(track.shell, x, y) == 1 and side_of_ring(track.hole, x, y) == -1


@kernel
def is_in_inner_lane(track, x, y):
    """Tell whether (x, y) is strictly between centre line and inner border of a loop."""
    return side_of_ring(track.centre, x, y) * side_of_ring(track.inner, x, y) == -1


@kernel
def locate_point(track, x, y):
    """Return where (x, y) lies along a track.

    Returns (arc, distance, centre x, centre y, inner x, inner y, outer x, outer y). The border points are the
    projections of the *centre point*, not of (x, y) (facts: simapp `track_data.py`).
    """
    s, distance, cx, cy = nearest_on_line(track.centre, track.arc, x, y)
    _, _, ix, iy = nearest_on_line(track.inner, track.inner_arc, cx, cy)
    _, _, ox, oy = nearest_on_line(track.outer, track.outer_arc, cx, cy)
    return s, distance, cx, cy, ix, iy, ox, oy


@kernel
def is_left_of_centre(track, x, y, ix, iy, ox, oy):
    """Tell whether (x, y) lies left of the centre line in driving direction, by the nearer of its border points."""
    to_inner = math.hypot(x - ix, y - iy)
    to_outer = math.hypot(x - ox, y - oy)
    return (to_inner < to_outer) == track.is_ccw


@kernel
def nearer_waypoint(track, before, after, x, y):
    """Return the nearer of two waypoints, `before` where they are equally far."""
    to_before = math.hypot(x - track.centre[before, 0], y - track.centre[before, 1])
    to_after = math.hypot(x - track.centre[after, 0], y - track.centre[after, 1])
    return before if to_before <= to_after else after


@kernel
def locate_points(track, points, places, waypoints, is_left):
    """Fill `places` (P, 8), `waypoints` (P, 3: previous, next, nearer) and `is_left` (P,) for `points` (P, 2)."""
    for p in range(points.shape[0]):
        x, y = points[p, 0], points[p, 1]
        s, distance, cx, cy, ix, iy, ox, oy = locate_point(track, x, y)
        before, after = waypoints_around(track.arc, s)
        places[p, 0], places[p, 1] = s, distance
        places[p, 2], places[p, 3] = cx, cy
        places[p, 4], places[p, 5] = ix, iy
        places[p, 6], places[p, 7] = ox, oy
        waypoints[p, 0], waypoints[p, 1] = before, after
        waypoints[p, 2] = nearer_waypoint(track, before, after, x, y)
        is_left[p] = is_left_of_centre(track, x, y, ix, iy, ox, oy)


@kernel
def points_on_road(track, points, on_road):
    """Fill `on_road` (P,) for `points` (P, 2)."""
    for p in range(points.shape[0]):
        on_road[p] = is_on_road(track, points[p, 0], points[p, 1])
