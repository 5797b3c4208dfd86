"""Classical lines: the centre line, the shortest line, the line of least curvature. Begin with `classical_line`.

A line is an offset from the centre line at every station. `least_bend` finds the offsets with the least integral of
squared curvature plus a price of length, within the borders: with a small price the line of least curvature, with a
large one the shortest that a car can follow. Prices between them often give the best lap time.
"""

from __future__ import annotations

import numpy as np

from racecraft.worlds.deepracer.driving.profile import with_speeds
from racecraft.worlds.deepracer.driving.racing_line import RacingLine
from racecraft.worlds.deepracer.driving.road_frame import RoadFrame, road_frame
from racecraft.worlds.deepracer.env.vehicle import CarProfile
from racecraft.worlds.deepracer.tracks.track import Track

LINES = ("centre", "shortest", "least-curvature")
LENGTH_PRICES = {"shortest": 1.0, "least-curvature": 1e-3}
"""Price of the length, 1/m²: a metre costs as much as a metre of curvature 1/m at price 1."""
SPACING_M = 0.10
OVERHANG_M = 0.05
"""base_link may run so far beyond a border: a wheel is still on the road."""
FARTHEST_INSIDE = 0.7
"""Largest offset towards the inside of a bend, as a share of its radius."""
ROUNDS, DAMPING = 12, 0.5
"""Linearisations of the curvature, and the share of each step that is taken."""
MAX_SWEEPS = 60


def classical_line(track: Track, car: CarProfile, top_speed: float, kind: str) -> RacingLine:
    """Return one of LINES, at the highest speeds that the car can hold along it.

    Args:
        track: The track, in driving direction.
        car: How the car answers steering and throttle.
        top_speed: Largest speed command, m/s.
        kind: One of LINES.
    """
    frame = road_frame(track, SPACING_M)
    offset = np.zeros(len(frame.xy)) if kind == "centre" else least_bend(frame, LENGTH_PRICES[kind])
    return with_speeds(frame, offset, car, top_speed)


def least_bend(frame: RoadFrame, length_price: float) -> np.ndarray:
    """Return the offsets (N,) m with the least integral of squared curvature plus `length_price` times the length."""
    first, second = _differences(len(frame.xy), frame.closed)
    normal, step = frame.normal, frame.spacing
    low, high = _bounds(frame)
    offset, held = np.zeros(len(frame.xy)), np.zeros(len(frame.xy), np.int8)
    for _ in range(ROUNDS):
        # Curvature is linear in the second differences once the direction and pace of the first are fixed.
        ahead = first @ frame.points(offset)
        pace = np.hypot(*ahead.T)
        across = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / (pace**2.5)[:, None]
        bend = across[:, :1] * (second * normal[:, 0]) + across[:, 1:] * (second * normal[:, 1])
        stretch = [np.sqrt(length_price / step) * first * normal[:, k] for k in (0, 1)]
        rows = np.concatenate([bend, *stretch])
        at_centre = np.concatenate(
            [(across * (second @ frame.xy)).sum(axis=1), *(np.sqrt(length_price / step) * (first @ frame.xy)).T]
        )
        wanted, held = _least_squares_within(rows, at_centre, low, high, held)
        offset = offset + DAMPING * (wanted - offset)
    return offset


def _bounds(frame: RoadFrame) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest and largest offsets (N,) m; an open line begins on the centre line."""
    inside = FARTHEST_INSIDE / np.maximum(np.abs(frame.curvature), 1e-6)
    low, high = -(frame.right + OVERHANG_M), frame.left + OVERHANG_M
    low = np.where(frame.curvature < 0.0, np.maximum(low, -inside), low)
    high = np.where(frame.curvature > 0.0, np.minimum(high, inside), high)
    if not frame.closed:
        low[0] = high[0] = 0.0
    return low, high


def _differences(count: int, closed: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrices (N, N) of central first and second differences; of an open line the ends repeat."""
    one = np.eye(count)
    after, before = np.roll(one, 1, axis=1), np.roll(one, -1, axis=1)
    first, second = 0.5 * (after - before), after - 2.0 * one + before
    if not closed:
        first[0], first[-1] = first[1], first[-2]
        second[0], second[-1] = second[1], second[-2]
    return first, second


def _least_squares_within(
    rows: np.ndarray, constant: np.ndarray, low: np.ndarray, high: np.ndarray, held: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the x within bounds that minimises |rows·x + constant|², and which bounds hold it.

    A primal-dual active set: `held` (N,) is -1 at the lower bound, 1 at the upper, 0 where x is free, and starts as the
    last answer.
    """
    matrix, slope = rows.T @ rows, rows.T @ constant
    matrix = matrix + 1e-9 * np.trace(matrix) / len(slope) * np.eye(len(slope))
    for _ in range(MAX_SWEEPS):
        x = np.where(held < 0, low, np.where(held > 0, high, 0.0))
        free = held == 0
        x[free] = np.linalg.solve(matrix[np.ix_(free, free)], -slope[free] - matrix[np.ix_(free, ~free)] @ x[~free])
        force = -(matrix @ x + slope)
        beyond = np.sign(x - np.clip(x, low, high))
        wanted = np.where(free, beyond, np.where(force * held > 0.0, held, 0)).astype(np.int8)
        if (wanted == held).all():
            break
        held = wanted
    return np.clip(x, low, high), held
