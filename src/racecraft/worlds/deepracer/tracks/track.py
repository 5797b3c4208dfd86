"""A circuit: centre line and borders, row by row, and where a point lies along them. Begin with `Track`.

The rows are the waypoints racers know from AWS: a loop's last row repeats its first, and indices count rows. Geometry
follows the original to the letter (facts: simapp `track_data.py`): the border points of a place are the projections of
its *centre point*, the road is the outer ring less the inner one, and a border is outside.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from racecraft.worlds.deepracer.tracks.kernels import geometry
from racecraft.worlds.deepracer.tracks.style import TrackStyle

SAME_POINT_M = 1e-9
"""Consecutive centre points nearer than this are one waypoint."""


class TrackArrays(NamedTuple):
    """A track as kernels take it, in one argument: contiguous float64 arrays and plain numbers."""

    centre: np.ndarray
    """(K, 2) m."""
    arc: np.ndarray
    """(K,) m, from 0 to the length."""
    inner: np.ndarray
    inner_arc: np.ndarray
    outer: np.ndarray
    outer_arc: np.ndarray
    shell: np.ndarray
    """(R, 2), the ring around the road; its last row repeats its first."""
    hole: np.ndarray
    """(R, 2), the ring the road goes around; (0, 2) for an open track."""
    closed: bool
    is_ccw: bool
    length: float
    """m along the centre line."""


class Pose(NamedTuple):
    """A place and a direction: metres, and radians from the x axis, left positive."""

    x: float
    y: float
    yaw: float


class Location(NamedTuple):
    """Where P points lie along a track, in arrays."""

    arc: np.ndarray
    """(P,) m along the centre line from the start line."""
    distance: np.ndarray
    """(P,) m from the point to the centre line."""
    centre_point: np.ndarray
    """(P, 2) nearest point of the centre line."""
    inner_point: np.ndarray
    """(P, 2) nearest point of the inner border to the centre point."""
    outer_point: np.ndarray
    """(P, 2) nearest point of the outer border to the centre point."""
    width: np.ndarray
    """(P,) m between the two border points."""
    previous_waypoint: np.ndarray
    """(P,) row behind the centre point."""
    next_waypoint: np.ndarray
    """(P,) row ahead of the centre point."""
    nearer_waypoint: np.ndarray
    """(P,) the nearer of the two to the point."""
    is_left: np.ndarray
    """(P,) the point lies left of the centre line, seen in driving direction."""


@dataclass(frozen=True, eq=False)
class Track:
    """A circuit of K rows. Coordinates in metres, x east, y north; build it with `from_rows`.

    Args:
        name: The name users type, such as "reinvent_base".
        centre: (K, 2) centre line; for a loop the last row repeats the first.
        inner: (K, 2) inner border, row by row beside the centre.
        outer: (K, 2) outer border.
        closed: The track is a loop.
        look: Colours and painted lines.
        is_reversed: The rows run against the direction in which the track was laid out.
        repeated_rows: Numbers of the rows of its route file that repeat the row before; they are not among the K.
        title: The name on the poster, such as "re:Invent 2018".
        description: A sentence about it.
        tags: Words to find it by.
    """

    name: str
    centre: np.ndarray
    inner: np.ndarray
    outer: np.ndarray
    closed: bool
    look: TrackStyle = field(default_factory=TrackStyle)
    is_reversed: bool = False
    repeated_rows: tuple[int, ...] = ()
    title: str = ""
    description: str = ""
    tags: tuple[str, ...] = ()

    @classmethod
    def from_rows(cls, name: str, rows: np.ndarray, **details) -> Track:
        """Build a track from (K, 6) rows: centre x, y, inner x, y, outer x, y.

        Consecutive rows with the same centre point become one, the last row always stays, and rows that end where they
        began are a loop (facts: simapp `track_data.py`). `details` are the remaining fields.
        """
        rows = np.asarray(rows, dtype=np.float64)[:, :6]
        repeated = np.hypot(*np.diff(rows[:, :2], axis=0).T) <= SAME_POINT_M
        details.setdefault("repeated_rows", tuple((np.flatnonzero(repeated) + 1).tolist()))
        rows = _without_repeated_rows(rows)
        centre, inner, outer = (_frozen(rows[:, k : k + 2]) for k in (0, 2, 4))
        return cls(name, centre, inner, outer, closed=bool((rows[0] == rows[-1]).all()), **details)

    @cached_property
    def arc(self) -> np.ndarray:
        """(K,) m along the centre line at each row, from 0 to the length."""
        return _frozen(_running_length(self.centre))

    @property
    def length(self) -> float:
        """Metres along the centre line, once around."""
        return float(self.arc[-1])

    @cached_property
    def is_ccw(self) -> bool:
        """The track runs counter-clockwise; an open one counts as such unless reversed."""
        return _twice_area(self.centre) > 0 if self.closed else not self.is_reversed

    @property
    def direction(self) -> str:
        """One word for the way round: "ccw", "cw" or "open"."""
        return "open" if not self.closed else "ccw" if self.is_ccw else "cw"

    @cached_property
    def widths(self) -> np.ndarray:
        """(K,) m at each waypoint, between the border points nearest to it (rows need not stand square to the road)."""
        return _frozen(self.locate(self.centre).width)

    @property
    def width_mean(self) -> float:
        """Mean of `widths` in metres, the closing row counted once."""
        return float(self.widths[: -1 if self.closed else None].mean())

    @cached_property
    def bounds(self) -> tuple[float, float, float, float]:
        """Rectangle around both borders: x0, y0, x1, y1."""
        borders = np.concatenate([self.inner, self.outer])
        (x0, y0), (x1, y1) = borders.min(axis=0), borders.max(axis=0)
        return float(x0), float(y0), float(x1), float(y1)

    @property
    def field_bounds(self) -> tuple[float, float, float, float]:
        """Rectangle of the field around the road: the look's, or the bounds and a metre more."""
        if self.look.field_bounds is not None:
            return self.look.field_bounds
        x0, y0, x1, y1 = self.bounds
        return x0 - 1.0, y0 - 1.0, x1 + 1.0, y1 + 1.0

    @property
    def rows(self) -> np.ndarray:
        """(K, 6) rows as AWS has them: centre, inner, outer."""
        return np.hstack([self.centre, self.inner, self.outer])

    def hash(self) -> str:
        """Twelve letters that name this geometry and direction, whatever the track is called."""
        digest = hashlib.sha256(np.ascontiguousarray(self.rows, dtype="<f8").tobytes())
        digest.update(bytes([self.closed, self.is_ccw]))
        return digest.hexdigest()[:12]

    def reversed(self) -> Track:
        """Return the same circuit driven the other way: rows flipped, borders keep their role, start line stays."""
        centre, inner, outer = (_frozen(line[::-1]) for line in (self.centre, self.inner, self.outer))
        filed = len(self.centre) + len(self.repeated_rows)
        repeated = tuple(sorted(filed - row for row in self.repeated_rows))
        return replace(
            self, centre=centre, inner=inner, outer=outer, is_reversed=not self.is_reversed, repeated_rows=repeated
        )

    def as_filed(self) -> Track:
        """Return the circuit with every row of its route file, so that waypoints are counted as the file counts them.

        The same road: rows that repeat the one before have no length.
        """
        if not self.repeated_rows:
            return self
        own = self.of_filed_rows()
        centre, inner, outer = (_frozen(line[own]) for line in (self.centre, self.inner, self.outer))
        return replace(self, centre=centre, inner=inner, outer=outer, repeated_rows=())

    def of_filed_rows(self) -> np.ndarray:
        """Return, for every row of the route file, the number of ours; AWS's logs count waypoints by the file's."""
        filed = np.arange(len(self.centre) + len(self.repeated_rows))
        return filed - np.searchsorted(self.repeated_rows, filed, side="right")

    def lane(self, side: str) -> np.ndarray:
        """Return the (K, 2) middle of the "inner" or "outer" lane: halfway between centre line and border."""
        return (self.centre + {"inner": self.inner, "outer": self.outer}[side]) / 2

    def locate(self, points: np.ndarray) -> Location:
        """Return where points (P, 2) lie along the track."""
        points = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 2)
        places = np.empty((len(points), 8))
        waypoints = np.empty((len(points), 3), dtype=np.int64)
        is_left = np.empty(len(points), dtype=np.bool_)
        geometry.locate_points(self.arrays(), points, places, waypoints, is_left)
        inner, outer = places[:, 4:6], places[:, 6:8]
        width = np.hypot(*(outer - inner).T)
        return Location(
            places[:, 0], places[:, 1], places[:, 2:4], inner, outer, width,
            waypoints[:, 0], waypoints[:, 1], waypoints[:, 2], is_left,
        )  # fmt: skip

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Tell for points (P, 2) whether they are strictly inside the road; a border is outside. Shape (P,), bool."""
        points = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 2)
        on_road = np.empty(len(points), dtype=np.bool_)
        geometry.points_on_road(self.arrays(), points, on_road)
        return on_road

    def pose_at(self, arc: float) -> Pose:
        """Return the pose on the centre line `arc` metres from the start, looking to the next waypoint.

        A loop wraps; an open track holds `arc` within its ends. (Facts: simapp, forward difference.)
        """
        return Pose(*geometry.pose_on_line(self.arrays().centre, self.arrays().arc, self.closed, float(arc)))

    def pose_at_share(self, share: float) -> Pose:
        """Return the pose at a share of the lap, 0 to 1, as start positions are given."""
        return self.pose_at(share * self.length)

    def arrays(self) -> TrackArrays:
        """Return the track as kernels take it. Built once; do not write into it."""
        return self._arrays

    @cached_property
    def _arrays(self) -> TrackArrays:
        if self.closed:
            shell, hole = self.outer, self.inner
        else:
            strip = np.concatenate([self.outer, self.inner[::-1]])
            shell, hole = np.concatenate([strip, strip[:1]]), np.empty((0, 2))
        inner_arc, outer_arc = _running_length(self.inner), _running_length(self.outer)
        return TrackArrays(
            _own(self.centre), _own(self.arc), _own(self.inner), inner_arc, _own(self.outer), outer_arc,
            _own(shell), _own(hole), self.closed, self.is_ccw, self.length,
        )  # fmt: skip


def _without_repeated_rows(rows: np.ndarray) -> np.ndarray:
    steps = np.hypot(*np.diff(rows[:, :2], axis=0).T)
    keep = np.concatenate([[True], steps > SAME_POINT_M])
    if not keep[-1]:  # the last row stays; the one it repeats goes instead
        keep[-1] = True
        keep[np.flatnonzero(keep)[-2]] = False
    return rows[keep]


def _running_length(line: np.ndarray) -> np.ndarray:
    steps = np.diff(line, axis=0)
    return np.concatenate([[0.0], np.cumsum(np.sqrt(steps[:, 0] * steps[:, 0] + steps[:, 1] * steps[:, 1]))])


def _twice_area(ring: np.ndarray) -> float:
    x, y = (ring - ring[0]).T
    return float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


def _own(array: np.ndarray) -> np.ndarray:
    """Return a writable copy, so that every kernel sees one and the same array type."""
    return np.array(array, dtype=np.float64, order="C")


def _frozen(array: np.ndarray) -> np.ndarray:
    copy = np.array(array, dtype=np.float64, order="C")
    copy.setflags(write=False)
    return copy
