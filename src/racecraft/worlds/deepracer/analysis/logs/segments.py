"""A circuit's corners and the straights between them, as places of the lap. Begin with `find_segments`.

Where a corner begins and ends and what it is called is `corners.py`'s rule, the same that times laps in telemetry. A
straight too short to be driven differently is shared by the corners beside it. A segment may lie across the start line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot
from racecraft.contract.world import Array
from racecraft.pages.colours import BLUE, ORANGE, RED
from racecraft.worlds.deepracer.analysis.logs.circuit import on_track
from racecraft.worlds.deepracer.analysis.logs.plot import map_sheet
from racecraft.worlds.deepracer.driving.road_frame import road_frame
from racecraft.worlds.deepracer.driving.telemetry.corners import SPACING_M, THE_STRAIGHT, Corner, find_corners
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

SHORTEST_M = 1.0
"""A straight's."""
STRAIGHT = "straight"
COLOURS = {"left": BLUE, STRAIGHT: "#9aa5ae", "right": ORANGE}


@dataclass(frozen=True)
class Segment:
    """A straight or a curve."""

    name: str
    """A corner's own, such as "turn 3 (left)", or "straight after turn 3"."""
    kind: str
    """left, straight or right."""
    begin: float
    """Share of the lap, 0 to 1, at which it begins; larger than `end` where it lies across the start line."""
    end: float
    length_m: float
    turn_rad: float
    """How far the road turns in it, left positive."""


@dataclass(frozen=True, eq=False)
class Segments:
    """A circuit's segments in driving order, the one that holds the start line first."""

    all: tuple[Segment, ...]

    @property
    def names(self) -> dict[int, str]:
        """Names by index."""
        return {index: segment.name for index, segment in enumerate(self.all)}

    def of(self, lap_share: Array) -> Array:
        """Return the index of the segment at shares of the lap (T,), 0 to 1."""
        first, *others = self.all
        begins = [one.begin for one in others] + ([first.begin] if first.begin > 0.0 else [])
        return np.searchsorted(begins, lap_share, side="right") % len(self.all)


def find_segments(track: Track) -> Segments:
    """Return the segments of a circuit in driving order."""
    pieces = sorted(_pieces(find_corners(track), track), key=lambda piece: piece[2] - (piece[2] > piece[3]))
    frame = road_frame(track, SPACING_M)
    turned = np.concatenate([[0.0], np.cumsum(frame.curvature) * frame.spacing])
    segments = []
    for name, kind, begin, end in pieces:
        length_m = ((end - begin) % 1.0 or 1.0) * track.length
        before, after = np.interp([begin, end], np.linspace(0.0, 1.0, len(turned)), turned)
        turn_rad = float(after - before + (turned[-1] if begin > end else 0.0))
        segments.append(Segment(name, kind, begin, end, length_m, turn_rad))
    return Segments(tuple(segments))


def _pieces(corners: Sequence[Corner], track: Track) -> list[tuple[str, str, float, float]]:
    """Return name, kind, begin and end (shares of the lap) of each corner and of each straight between two."""
    if not corners:
        return [(THE_STRAIGHT, STRAIGHT, 0.0, 1.0)]
    begins, ends = [one.begin for one in corners], [one.end for one in corners]
    straights = []
    for k, end in enumerate(ends):
        after = (k + 1) % len(corners)
        gap = (begins[after] - end) % 1.0
        if not track.closed and after == 0:
            straights.append(("straight before turn 1", STRAIGHT, 0.0, begins[0]))
            straights.append((f"straight after turn {k + 1}", STRAIGHT, end, 1.0))
        elif gap * track.length < SHORTEST_M:
            ends[k] = begins[after] = (end + 0.5 * gap) % 1.0
        else:
            straights.append((f"straight after turn {k + 1}", STRAIGHT, end, begins[after]))
    return [*straights, *((one.name, one.side, begins[k], ends[k]) for k, one in enumerate(corners))]


def in_segments(ticks: pl.DataFrame | pl.LazyFrame, track: Track, segments: Segments | None = None) -> pl.DataFrame:
    """Add `segment`, the index of the segment in which each tick lies, counted from 0."""
    import polars as pl

    frame = on_track(ticks, track)
    segments = segments or find_segments(track)
    return frame.with_columns(pl.Series("segment", segments.of(frame["lap_share"].to_numpy()).astype(np.int32)))


def segments_plot(track: Track) -> Plot:
    """Return the segments as a table (name, kind, begin, end, length_m, turn_rad) and a map."""
    import polars as pl

    found = find_segments(track)
    data = pl.DataFrame([vars(segment) for segment in found.all])
    return Plot("segments", f"Straights and curves of {track.title or track.name}", data, lambda: _draw(track, found))


def _draw(track: Track, found: Segments) -> Any:
    figure, (axes,) = map_sheet(track, 1, [""])
    for segment in found.all:
        length = (segment.end - segment.begin) % 1.0 or 1.0
        arcs = (segment.begin + np.linspace(0.0, length, 80)) % 1.0 * track.length
        line = np.stack([np.interp(arcs, track.arc, track.centre[:, k]) for k in (0, 1)], axis=1)
        axes.plot(*line.T, color=COLOURS[segment.kind], lw=5, solid_capstyle="butt", zorder=3, alpha=0.85)
        axes.text(*line[40], segment.name, fontsize=9, ha="center", va="center", zorder=4, color=RED,
                  bbox={"fc": "white", "ec": "none", "alpha": 0.85, "pad": 1.5})  # fmt: skip
    return figure
