"""Smooth curves through a lap: cubic B-splines over metres of road, around a loop or from end to end.

A curve has M control points and M knots (a loop) or M - 2 (an open line: its ends included). The weights of the
control points at given stations are a matrix, `weights`; a curve's points are that matrix times the control points, and
`lay_curve` finds control points by least squares, adding knots where the curve misses most.
"""

from __future__ import annotations

import numpy as np

DEGREE = 3
FEWEST_KNOTS = 5


def weights(knots: np.ndarray, stations: np.ndarray, length: float, closed: bool) -> np.ndarray:
    """Return the weight (P, M) of each control point at each station.

    Args:
        knots: Increasing stations in metres; a loop's lie in [0, length), an open line's start at 0 and end at length.
        stations: (P,) metres, 0 to length.
        length: Metres once around, or from end to end.
        closed: The curve is a loop.
    """
    if closed:
        laps = [knots[-DEGREE:] - length, knots, knots[: DEGREE + 1] + length]
        ladder, control_points = np.concatenate(laps), len(knots)
        stations = np.where(stations < knots[0], stations + length, stations)
    else:
        ladder = np.concatenate([[knots[0]] * DEGREE, knots, [knots[-1]] * DEGREE])
        control_points = len(knots) + DEGREE - 1
    basis = _basis(ladder, stations)
    if closed:
        folded = np.zeros((len(stations), control_points))
        for k in range(basis.shape[1]):
            folded[:, k % control_points] += basis[:, k]
        basis = folded
    return basis


def lay_curve(
    stations: np.ndarray, points: np.ndarray, closed: bool, farthest: float, mean: float
) -> tuple[np.ndarray, np.ndarray]:
    """Lay a curve with few knots past points, so that none is farther than `farthest` and `mean` holds on average.

    Args:
        stations: (K,) metres of each point, from 0 to the length.
        points: (K, D); a loop's last row repeats its first.
        closed: The curve is a loop.
        farthest: Largest distance allowed at a point.
        mean: Largest mean distance allowed.

    Returns:
        The rows at which the knots sit (increasing, from 0), and the control points (M, D), rounded to 0.1 mm.
    """
    length = float(stations[-1])
    last = len(stations) - 1
    rows = np.unique(np.linspace(0, last, FEWEST_KNOTS + (not closed)).round().astype(int))
    rows = rows[rows < last] if closed else rows
    wanted = slice(0, last) if closed else slice(None)
    while True:
        matrix = weights(stations[rows], stations[wanted], length, closed)
        control = np.linalg.lstsq(matrix, points[wanted], rcond=None)[0].round(4)
        missed = np.sqrt(((matrix @ control - points[wanted]) ** 2).sum(axis=1))
        if missed.max() <= farthest and missed.mean() <= mean:
            return rows, control
        added = _rows_to_add(rows, missed, last, min(farthest, 2 * mean))
        if len(added) == 0:
            return rows, control
        rows = np.union1d(rows, added)


def curve_points(rows: np.ndarray, control: np.ndarray, stations: np.ndarray, closed: bool) -> np.ndarray:
    """Return the curve's points (K, D) at the stations; `rows` and `control` are what `lay_curve` returned."""
    return weights(stations[rows], stations, float(stations[-1]), closed) @ control


def _rows_to_add(rows: np.ndarray, missed: np.ndarray, last: int, limit: float) -> np.ndarray:
    """Choose one new knot row inside every gap between knots in which the curve misses by more than the limit."""
    edges = np.append(rows, last) if rows[-1] != last else rows
    added = []
    worst_first = []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        worst = missed[low : min(high + 1, len(missed))].max()
        if high - low >= 2:
            worst_first.append((worst, (low + high) // 2))
            if worst > limit:
                added.append((low + high) // 2)
    if not added and worst_first:  # every bad gap is full: give a knot to the worst gap that can take one
        added.append(max(worst_first)[1])
    return np.array(added, dtype=int)


def _basis(ladder: np.ndarray, stations: np.ndarray) -> np.ndarray:
    """Return the cubic B-spline basis (P, len(ladder) - 4) by the Cox-de Boor recursion."""
    intervals = len(ladder) - 1
    span = np.clip(np.searchsorted(ladder, stations, side="right") - 1, DEGREE, intervals - DEGREE - 1)
    basis = np.zeros((len(stations), intervals))
    basis[np.arange(len(stations)), span] = 1.0
    for degree in range(1, DEGREE + 1):
        raised = np.zeros((len(stations), intervals - degree))
        for k in range(intervals - degree):
            rise, fall = ladder[k + degree] - ladder[k], ladder[k + degree + 1] - ladder[k + 1]
            if rise > 0:
                raised[:, k] += (stations - ladder[k]) / rise * basis[:, k]
            if fall > 0:
                raised[:, k] += (ladder[k + degree + 1] - stations) / fall * basis[:, k + 1]
        basis = raised
    return basis
