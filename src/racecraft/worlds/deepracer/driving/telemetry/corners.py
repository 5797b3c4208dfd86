"""The corners of a circuit, found from its curvature and numbered from the start line. Begin with `find_corners`.

A corner begins where the smoothed centre line bends more sharply than ENTER and ends where it bends less than LEAVE:
the hysteresis keeps a bend whose curvature flickers in one piece. Bends that turn the road by less than MIN_TURN_RAD
are no corners.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.road_frame import RoadFrame, road_frame
from racecraft.worlds.deepracer.tracks.track import Track

SPACING_M = 0.05
WINDOW_M = 0.4
"""Curvature is averaged over so much of the centre line."""
ENTER = 0.5
"""1/m: a corner begins at a radius of 2 m."""
LEAVE = 0.25
"""1/m: a corner ends at a radius of 4 m."""
MIN_TURN_RAD = np.radians(20.0)
THE_STRAIGHT = "the straight"
"""What a road without corners is called as a place."""
BRAKING_M = 1.0
"""A corner's zone begins so far before the corner, or half-way from the corner before it if that is nearer."""


@dataclass(frozen=True)
class Corner:
    """A stretch in which the road bends one way. Shares of the lap count from the start line, 0 to 1."""

    number: int
    """Counted from 1, in driving order; a corner that lies across the start line is the last."""
    begin: float
    end: float
    """Smaller than `begin` where the corner lies across the start line."""
    turn_rad: float
    """How far the road turns, left positive."""
    radius_m: float
    """Of the centre line at its sharpest."""
    zone_begin: float
    """Where its zone begins. A zone ends where the next one begins, so the zones of a circuit are the whole lap: a
    corner's zone holds its braking and the straight behind it, on which a slow exit costs time."""

    @property
    def side(self) -> str:
        """Return "left" or "right"."""
        return "left" if self.turn_rad > 0 else "right"

    @property
    def name(self) -> str:
        """Return "turn 3 (left)"."""
        return f"turn {self.number} ({self.side})"


def find_corners(track: Track) -> tuple[Corner, ...]:
    """Return a circuit's corners in driving order; none on a straight road."""
    frame = road_frame(track, SPACING_M)
    bend = _smoothed(frame)
    pieces = [piece for piece in _pieces(bend, frame.closed) if abs(_turn(bend, piece, frame)) >= MIN_TURN_RAD]
    pieces.sort(key=lambda piece: piece[-1])
    lap = len(bend) if frame.closed else len(bend) - 1
    corners = []
    for number, piece in enumerate(pieces, 1):
        sharpest = float(np.abs(bend[piece % len(bend)]).max())
        gap = _gap_before(pieces, number - 1, lap, frame.closed)
        zone = (piece[0] - min(BRAKING_M / frame.spacing, 0.5 * gap)) / lap
        ends = (piece[0] / lap, (piece[-1] + 1) / lap)
        begin, end = (share % 1.0 if frame.closed else min(share, 1.0) for share in ends)
        zone_begin = zone % 1.0 if frame.closed else max(zone, 0.0)
        corners.append(
            Corner(number, float(begin), float(end), _turn(bend, piece, frame), 1.0 / sharpest, float(zone_begin))
        )
    return tuple(corners)


def _smoothed(frame: RoadFrame) -> Array:
    """Return the curvature (N,) 1/m, averaged over WINDOW_M."""
    width = max(1, round(WINDOW_M / frame.spacing)) | 1
    padded = np.pad(frame.curvature, width // 2, mode="wrap" if frame.closed else "edge")
    return np.convolve(padded, np.ones(width) / width, "valid")


def _pieces(bend: Array, closed: bool) -> list[Array]:
    """Return the stations of every bend; a bend across the start line counts on beyond the lap's last station."""
    side = np.sign(bend).astype(int)
    core, around = side * (np.abs(bend) > ENTER), side * (np.abs(bend) > LEAVE)
    count = len(bend)
    edges = np.flatnonzero(around != np.roll(around, 1))
    if not closed:
        edges = np.union1d([0], edges[edges > 0])
    if not len(edges):
        return []
    ends = np.append(edges[1:], edges[0] + count if closed else count)
    pieces = [np.arange(first, last) for first, last in zip(edges, ends, strict=True)]
    bends = [piece for piece in pieces if around[piece[0] % count] and core[piece % count].any()]
    return [piece if closed else piece[piece < count] for piece in bends]


def _turn(bend: Array, piece: Array, frame: RoadFrame) -> float:
    return float(bend[piece % len(bend)].sum() * frame.spacing)


def _gap_before(pieces: list[Array], index: int, lap: int, closed: bool) -> float:
    """Return how many stations lie between a bend and the one before it."""
    begin = int(pieces[index][0])
    if index:
        return max(0.0, begin - int(pieces[index - 1][-1]))
    return float(begin - (int(pieces[-1][-1]) - lap)) if closed else 2.0 * begin
