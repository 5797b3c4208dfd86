"""Laps on the map of their track, as paths of an SVG. See `lap_map`. On the map y runs downwards, in metres."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.ghosts import drive_of, points_of
from racecraft.worlds.deepracer.analysis.svg_lines import svg_path, svg_view
from racecraft.worlds.deepracer.driving.telemetry.losses import LapComparison
from racecraft.worlds.deepracer.driving.telemetry.reference import Reference
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.tracks.track import Track

COLOURS = 5
"""Values of the tokens, from slow to fast."""
EDGE_M = 0.6
CAR_M = (0.36, 0.2)
"""Length and width of a car on the map: a little larger than it is, so that it can be seen."""


def lap_map(compared: LapComparison) -> dict[str, Any]:
    """Return the road, the lap coloured by speed, the reference, and the corners' numbers beside the road."""
    track = compared.timing.laps.track
    speed = _filled(compared.lap.speed_mps)
    slow, fast = float(speed.min()), float(speed.max())
    return road_map(track) | {
        "words": f"{track.title or track.name}: the lap coloured by speed, the reference dashed, corners numbered",
        "reference": line_path(compared.reference, track),
        "lap": _coloured(points_of(compared.lap.offset_m, track), speed, track.closed),
        "corners": _corners(compared, _size(track)),
        "slow": f"{slow:.1f}",
        "fast": f"{fast:.1f} m/s",
    }


def road_map(track: Track) -> dict[str, Any]:
    """Return what every map of laps has: view, road, start line, the shape of a car, and the radius of a mark, m."""
    size = _size(track)
    length, width = (one * max(1.0, size / 10.0) / 2.0 for one in CAR_M)
    return {
        "view": svg_view(track, EDGE_M + 0.03 * size),
        "road": _road(track),
        "start": svg_path(np.array([track.inner[0], track.outer[0]])),
        "mark": round(0.022 * size, 3),
        "car": f"M{length:.2f} 0L{0.4 * length:.2f} {width:.2f}H{-length:.2f}V{-width:.2f}H{0.4 * length:.2f}Z",
    }


def line_path(lap: Reference, track: Track) -> str:
    """Return the line of a lap as a path."""
    return svg_path(points_of(lap.offset_m, track), track.closed)


def moving_cars(laps: Sequence[Reference], track: Track) -> dict[str, Any]:
    """Return where the cars of laps are, tick by tick, as `<rc-ghosts>` reads it.

    `cars` has a list a lap, from the start line to the lap's end: x, y downwards (m), degrees clockwise.
    """
    cars = []
    for lap in laps:
        drive = drive_of(lap, track, int(np.ceil(lap.lap_seconds / TICK_SECONDS)) + 1)
        rows = np.column_stack([drive.x_m, -drive.y_m, -np.degrees(drive.yaw_rad)])
        cars.append([[round(x, 3), round(y, 3), round(angle, 1)] for x, y, angle in rows.tolist()])
    return {"tick": TICK_SECONDS, "ticks": max(len(car) for car in cars), "cars": cars}


def _size(track: Track) -> float:
    """Return the longer side of a track's bounds, m."""
    x0, y0, x1, y1 = track.bounds
    return float(max(x1 - x0, y1 - y0))


def _road(track: Track) -> str:
    if track.closed:
        return svg_path(track.outer, True) + svg_path(track.inner, True)
    return svg_path(np.concatenate([track.outer, track.inner[::-1]]), True)


def _coloured(points: Array, speed: Array, closed: bool) -> list[tuple[int, str]]:
    """Return stretches of one colour each: (1 to COLOURS, path)."""
    span = max(1e-9, float(speed.max() - speed.min()))
    level = np.minimum((COLOURS * (speed - speed.min()) / span).astype(int), COLOURS - 1)
    edges = np.flatnonzero(np.diff(level, prepend=-1))
    ends = [*edges[1:].tolist(), len(level)]
    stretches = []
    for first, last in zip(edges.tolist(), ends, strict=True):
        rows = np.arange(first, last + 1)
        rows = rows % len(points) if closed else rows[rows < len(points)]
        stretches.append((int(level[first]) + 1, svg_path(points[rows])))
    return stretches


def _corners(compared: LapComparison, size: float) -> list[dict[str, Any]]:
    """Return the corners' numbers with their places outside the road."""
    track, worst = compared.timing.laps.track, compared.worst
    marks = []
    for corner in compared.timing.corners:
        middle = (corner.begin + 0.5 * ((corner.end - corner.begin) % 1.0)) % 1.0 * track.length
        row = int(np.argmin(np.abs(track.arc - middle)))
        centre = track.centre[row]
        right = _right_of(track, row)
        outside = centre + np.sign(corner.turn_rad) * right * (0.5 * track.widths[row] + 0.035 * size)
        is_worst = worst is not None and worst.name == corner.name
        x, y = (round(float(one), 3) for one in outside)
        marks.append({"number": corner.number, "x": x, "y": -y, "worst": is_worst})
    return marks


def _right_of(track: Track, row: int) -> Array:
    """Return the unit vector to the right of the driving direction at a row."""
    ahead = track.centre[min(row + 1, len(track.centre) - 1)] - track.centre[max(row - 1, 0)]
    return np.array([ahead[1], -ahead[0]]) / max(1e-9, float(np.hypot(*ahead)))


def _filled(speed: Array) -> Array:
    """Return speeds with gaps closed by their neighbours."""
    known = np.isfinite(speed)
    return np.interp(np.arange(len(speed)), np.flatnonzero(known), speed[known])
