"""A track from a drawn line: scaled, smoothed, and given two borders. Begin with `make_track`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from racecraft.contract.errors import SettingError, TrackError
from racecraft.contract.message import Message
from racecraft.worlds.deepracer.tracks.drawings import Drawing
from racecraft.worlds.deepracer.tracks.importer import NARROWEST_M, WIDEST_M, check_rows, check_shape
from racecraft.worlds.deepracer.tracks.smooth_line import running_length, smooth_line
from racecraft.worlds.deepracer.tracks.track import Track

STEP_M = 0.15
"""Between two waypoints, as most of AWS's tracks have them."""
WIDTH_M, SMOOTHING_M = 0.76, 0.2
"""The road of re:Invent 2018; and what rounds the corners of a hand-drawn line."""
LONGEST_M = 200.0
FEW_POINTS_M = 0.3
"""A line whose points lie farther apart was clicked: it becomes a curve through them."""


@dataclass(frozen=True)
class RoadPlan:
    """What a drawn line becomes."""

    width_m: float = WIDTH_M
    length_m: float | None = None
    """Of the centre line; None: as drawn, where the drawing is in metres."""
    smoothing_m: float = SMOOTHING_M
    """Standard deviation of the Gaussian along the line."""
    closed: bool | None = None
    """None: as drawn."""

    def __post_init__(self) -> None:
        if not NARROWEST_M <= self.width_m <= WIDEST_M:
            raise SettingError(
                "width is {width:g} m; expected {low:g} to {high:g} m.",
                width=self.width_m, low=NARROWEST_M, high=WIDEST_M,
            )  # fmt: skip
        if not 0.0 <= self.smoothing_m <= 2.0:
            raise SettingError("smoothing is {value:g} m; expected 0 to 2 m.", value=self.smoothing_m)
        if self.length_m is not None and not 1.0 <= self.length_m <= LONGEST_M:
            raise SettingError(
                "length is {length:g} m; expected 1 to {longest:g} m.", length=self.length_m, longest=LONGEST_M
            )


def make_track(drawing: Drawing, plan: RoadPlan, name: str, path: str | Path) -> Track:
    """Return the track of a drawn line; it begins where the line does and is driven as the line was drawn.

    Args:
        drawing: The line.
        plan: Width, length, smoothing.
        name: Of the track.
        path: What messages name.

    Raises:
        SettingError: The drawing has no length of its own and none is given.
        TrackError: The line crosses itself or bends so tightly that a border folds.
    """
    closed = drawing.closed if plan.closed is None else plan.closed
    line = _rounded(_centred(drawing.points, closed, _scale(drawing, plan, closed)), closed)
    length = running_length(line)[-1]
    if not 1.0 <= length <= LONGEST_M:
        raise TrackError(
            path,
            Message("a line of {length:.1f} m", length=length),
            Message("1 to {longest:g} m", longest=LONGEST_M),
            "Give another --length.",
        )
    smooth = smooth_line(line, closed, plan.smoothing_m)
    if plan.length_m is not None:
        smooth = smooth * (plan.length_m / running_length(smooth)[-1])
    centre = _stations(smooth)
    normal = _normals(centre, closed)
    _require_width(centre, normal, plan.width_m, closed, path)
    left, right = centre + 0.5 * plan.width_m * normal, centre - 0.5 * plan.width_m * normal
    is_ccw = not closed or _area(centre) > 0
    inner, outer = (left, right) if is_ccw else (right, left)
    rows = np.hstack([centre, inner, outer])
    if closed:
        rows[-1] = rows[0]
    check_rows(rows, path)
    track = Track.from_rows(name, rows)
    check_shape(track, path)
    return track


def _scale(drawing: Drawing, plan: RoadPlan, closed: bool) -> float:
    """Return metres for each unit of the drawing."""
    if plan.length_m is None:
        if not drawing.in_metres:
            raise SettingError("The drawing has no size in metres; expected --length, the metres of its centre line.")
        return 1.0
    line = np.concatenate([drawing.points, drawing.points[:1]]) if closed else drawing.points
    return plan.length_m / float(running_length(line)[-1])


def _centred(points: np.ndarray, closed: bool, scale: float) -> np.ndarray:
    """Return the line in metres around the middle of its rectangle; a loop's last row repeats its first."""
    line = points * scale
    line = line - 0.5 * (line.min(axis=0) + line.max(axis=0))
    return np.concatenate([line, line[:1]]) if closed else line


def _rounded(line: np.ndarray, closed: bool) -> np.ndarray:
    """Return a line of few points as a curve through them (Catmull and Rom, centripetal); one of many stays."""
    if running_length(line)[-1] / len(line) < FEW_POINTS_M:
        return line
    ends = (line[-2:-1], line[1:2]) if closed else (2 * line[:1] - line[1:2], 2 * line[-1:] - line[-2:-1])
    padded = np.concatenate([ends[0], line, ends[1]])
    share = np.linspace(0.0, 1.0, 24, endpoint=False)[:, None]
    pieces = [
        _curve(padded[row], padded[row + 1], padded[row + 2], padded[row + 3], share) for row in range(len(line) - 1)
    ]
    return np.concatenate([*pieces, line[-1:]])


def _curve(before: np.ndarray, a: np.ndarray, b: np.ndarray, after: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Return the curve from a to b at shares (S, 1) of its parameter, (S, 2)."""
    t1, t2, t3 = np.cumsum([max(float(np.hypot(*step)) ** 0.5, 1e-9) for step in (a - before, b - a, after - b)])
    t = t1 + share * (t2 - t1)
    first = (t1 - t) / t1 * before + t / t1 * a
    middle = (t2 - t) / (t2 - t1) * a + (t - t1) / (t2 - t1) * b
    last = (t3 - t) / (t3 - t2) * b + (t - t2) / (t3 - t2) * after
    left = (t2 - t) / t2 * first + t / t2 * middle
    right = (t3 - t) / (t3 - t1) * middle + (t - t1) / (t3 - t1) * last
    curve: np.ndarray = (t2 - t) / (t2 - t1) * left + (t - t1) / (t2 - t1) * right
    return curve


def _stations(line: np.ndarray) -> np.ndarray:
    arc = running_length(line)
    stations = np.linspace(0.0, arc[-1], max(8, round(arc[-1] / STEP_M)) + 1)
    return np.column_stack([np.interp(stations, arc, line[:, k]) for k in (0, 1)])


def _normals(centre: np.ndarray, closed: bool) -> np.ndarray:
    """Return unit vectors to the left of the line, (K, 2)."""
    if closed:
        ring = centre[:-1]
        along = np.roll(ring, -1, axis=0) - np.roll(ring, 1, axis=0)
        along = np.concatenate([along, along[:1]])
    else:
        along = np.gradient(centre, axis=0)
    along = along / np.maximum(np.hypot(*along.T), 1e-12)[:, None]
    return np.column_stack([-along[:, 1], along[:, 0]])


def _require_width(centre: np.ndarray, normal: np.ndarray, width: float, closed: bool, path: str | Path) -> None:
    """Refuse a bend whose inner border would run backwards."""
    for side in (1.0, -1.0):
        border = centre + side * 0.5 * width * normal
        backwards = (np.diff(border, axis=0) * np.diff(centre, axis=0)).sum(axis=1) <= 0.0
        for row in np.flatnonzero(backwards)[:1].tolist():
            x, y = centre[row]
            raise TrackError(
                path,
                Message(
                    "at {share:.0f} % of the line ({x:.1f}, {y:.1f}) it bends within {half:.2f} m, half the width",
                    share=100 * row / len(centre), x=x, y=y, half=0.5 * width,
                ),
                "wider bends",
                "Draw it rounder, or give a larger --length or --smooth, or a smaller --width.",
            )  # fmt: skip


def _area(ring: np.ndarray) -> float:
    x, y = ring.T
    return float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) / 2)
