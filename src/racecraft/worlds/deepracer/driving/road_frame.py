"""The road in arc length: a smooth centre line with its heading, curvature and half widths. Begin with `road_frame`.

AWS's centre lines are polylines, whose curvature is a spike at every waypoint. They are resampled and smoothed with a
Gaussian of 12 cm before curvature is taken. Offsets n are positive to the left of the driving direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.worlds.deepracer.tracks.smooth_line import running_length, smooth_line
from racecraft.worlds.deepracer.tracks.track import Track


@dataclass(frozen=True, eq=False)
class RoadFrame:
    """The road at N stations, equally spaced along the smooth centre line; on a loop station N is station 0 again."""

    closed: bool
    spacing: float
    """m between two stations."""
    xy: np.ndarray
    """(N, 2) m."""
    heading: np.ndarray
    """(N,) rad, without jumps of 2π."""
    curvature: np.ndarray
    """(N,) 1/m, left positive."""
    left: np.ndarray
    """(N,) m from the centre line to the left border."""
    right: np.ndarray
    """(N,) m to the right border, positive."""

    @property
    def normal(self) -> np.ndarray:
        """(N, 2) unit vectors to the left."""
        return np.column_stack([-np.sin(self.heading), np.cos(self.heading)])

    def points(self, offset: np.ndarray) -> np.ndarray:
        """Return (N, 2) the points at offsets (N,) m from the centre line."""
        return self.xy + offset[:, None] * self.normal


def road_frame(track: Track, spacing: float) -> RoadFrame:
    """Return a track's road at stations about `spacing` m apart.

    Args:
        track: The track, in driving direction.
        spacing: m; made a little smaller or larger so that a whole number of steps fits the lap.
    """
    fine = smooth_line(track.centre, track.closed)
    arc = running_length(fine)
    steps = max(8, round(arc[-1] / spacing))
    stations = np.linspace(0.0, arc[-1], steps + 1)[: steps if track.closed else steps + 1]
    xy = np.column_stack([np.interp(stations, arc, fine[:, k]) for k in (0, 1)])
    step = float(arc[-1]) / steps
    heading = headings(xy, track.closed)
    normal = np.column_stack([-np.sin(heading), np.cos(heading)])
    borders = (track.inner, track.outer)
    left, right = (np.min([_ray_lengths(xy, side * normal, line) for line in borders], axis=0) for side in (1.0, -1.0))
    return RoadFrame(track.closed, step, xy, heading, _curvatures(heading, step, track.closed), left, right)


def headings(xy: np.ndarray, closed: bool) -> np.ndarray:
    """Return (N,) rad, the direction at each point by central differences, without jumps of 2π."""
    step = np.roll(xy, -1, axis=0) - np.roll(xy, 1, axis=0) if closed else np.gradient(xy, axis=0)
    return np.unwrap(np.arctan2(step[:, 1], step[:, 0]))


def _curvatures(heading: np.ndarray, step: float, closed: bool) -> np.ndarray:
    """Return (N,) 1/m by central differences of headings `step` m apart."""
    if not closed:
        return np.gradient(heading) / step
    turned = np.roll(heading, -1) - np.roll(heading, 1)
    return (np.mod(turned + np.pi, 2 * np.pi) - np.pi) / (2 * step)


def _ray_lengths(start: np.ndarray, ray: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Return (N,) m from each start along its unit ray to the nearest crossing with a polyline; inf without one."""
    edge, gap = np.diff(line, axis=0)[None], line[None, :-1] - start[:, None]
    across = ray[:, None, 0] * edge[..., 1] - ray[:, None, 1] * edge[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (gap[..., 0] * edge[..., 1] - gap[..., 1] * edge[..., 0]) / across
        share = (gap[..., 0] * ray[:, None, 1] - gap[..., 1] * ray[:, None, 0]) / across
        hits = (share >= -1e-9) & (share <= 1.0 + 1e-9) & (along >= 0.0)
    return np.where(hits, along, np.inf).min(axis=1)
