"""Straights and curves of any circuit, found from its curvature. Begin with `find_segments`.

The centre line is walked in even steps; where its smoothed radius is smaller than TIGHT_M the road is a curve. Pieces
too short to drive differently join their neighbours. A piece may lie across the start line.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot
from racecraft.contract.world import Array
from racecraft.pages.colours import BLUE, ORANGE, RED
from racecraft.worlds.deepracer.analysis.logs.circuit import on_track
from racecraft.worlds.deepracer.analysis.logs.plot import map_sheet
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

STEP_M = 0.05
SMOOTH_M = 0.8
TIGHT_M = 3.5
SHORTEST_M = 1.0
LEFT, STRAIGHT, RIGHT = 1, 0, -1
KINDS = {LEFT: "left", STRAIGHT: "straight", RIGHT: "right"}
COLOURS = {"left": BLUE, "straight": "#9aa5ae", "right": ORANGE}


@dataclass(frozen=True)
class Segment:
    """A straight or a curve."""

    number: int
    """Counted from 1 in driving order; 1 is the one that holds the start line."""
    kind: str
    """left, straight or right."""
    begin: float
    """Share of the lap, 0 to 1, at which it begins; larger than `end` where it lies across the start line."""
    end: float
    length_m: float
    turn_rad: float
    """How far the road turns in it, left positive."""

    @property
    def name(self) -> str:
        """Number and kind, such as "3 left"."""
        return f"{self.number} {self.kind}"


@dataclass(frozen=True, eq=False)
class Segments:
    """A circuit's segments in driving order."""

    all: tuple[Segment, ...]
    labels: Array
    """(B,) index among `all` for even pieces of the lap."""

    def of(self, lap_share: Array) -> Array:
        """Return the index of the segment at shares of the lap (T,), 0 to 1."""
        bins = len(self.labels)
        return self.labels[(np.asarray(lap_share) * bins).astype(np.int64).clip(0, bins - 1)]


def curvature(track: Track) -> tuple[Array, float]:
    """Return the smoothed curvature (B,) 1/m, left positive, at even steps along the lap, and the step in m."""
    bins = max(16, round(track.length / STEP_M))
    step = track.length / bins
    at = (np.arange(bins + 1) if not track.closed else np.arange(bins)) * step
    x, y = (np.interp(at, track.arc, track.centre[:, k]) for k in (0, 1))
    window = max(3, round(SMOOTH_M / step) | 1)
    if track.closed:
        heading = np.arctan2(np.roll(y, -1) - np.roll(y, 1), np.roll(x, -1) - np.roll(x, 1))
        turn = _wrapped(np.diff(heading, append=heading[:1]))
        padded = np.concatenate([turn[-(window // 2) :], turn, turn[: window // 2]])
    else:
        heading = np.arctan2(np.diff(y), np.diff(x))
        turn = _wrapped(np.diff(heading, append=heading[-1:]))
        padded = np.pad(turn, window // 2, mode="edge")
    return np.convolve(padded, np.full(window, 1.0 / window), "valid") / step, step


def find_segments(track: Track) -> Segments:
    """Return the segments of a circuit in driving order."""
    bend, step = curvature(track)
    kinds = np.where(np.abs(bend) > 1.0 / TIGHT_M, np.sign(bend).astype(int), STRAIGHT)
    kinds = _joined(kinds, max(1, round(SHORTEST_M / step)), track.closed)
    starts = np.flatnonzero(kinds != np.roll(kinds, 1))
    if not track.closed or len(starts) == 0:
        starts = np.union1d([0], starts[starts > 0])
    ends = np.roll(starts, -1)
    order = np.argsort(np.where((starts > ends) | (starts == 0), -1, starts), kind="stable")
    labels = np.empty(len(kinds), np.int64)
    segments = []
    for number, k in enumerate(order):
        at = np.arange(starts[k], ends[k] + (len(kinds) if ends[k] <= starts[k] else 0)) % len(kinds)
        labels[at] = number
        begin, end = starts[k] / len(kinds), (at[-1] + 1) / len(kinds)
        turn = float(bend[at].sum() * step)
        segments.append(Segment(number + 1, KINDS[int(kinds[at[0]])], begin, end, len(at) * step, turn))
    return Segments(tuple(segments), labels)


def in_segments(ticks: pl.DataFrame | pl.LazyFrame, track: Track, segments: Segments | None = None) -> pl.DataFrame:
    """Add `segment`, the index of the segment in which each tick lies, counted from 0."""
    import polars as pl

    frame = on_track(ticks, track)
    segments = segments or find_segments(track)
    return frame.with_columns(pl.Series("segment", segments.of(frame["lap_share"].to_numpy()).astype(np.int32)))


def segments_plot(track: Track) -> Plot:
    """Return the segments as a table (number, kind, begin, end, length_m, turn_rad) and a map."""
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


def _wrapped(angle: Array) -> Array:
    return (angle + np.pi) % (2 * np.pi) - np.pi


def _joined(kinds: Array, shortest: int, closed: bool) -> Array:
    """Give pieces shorter than `shortest` to the longer of their neighbours, the shortest piece first."""
    kinds = kinds.copy()
    while True:
        edges = np.flatnonzero(kinds != np.roll(kinds, 1))
        if not closed:
            edges = np.union1d([0], edges[edges > 0])
        if len(edges) < 2:
            return kinds
        lengths = np.diff(edges, append=edges[0] + len(kinds)) if closed else np.diff(edges, append=len(kinds))
        k = int(np.argmin(lengths))
        if lengths[k] >= shortest:
            return kinds
        at = (edges[k] + np.arange(lengths[k])) % len(kinds)
        last = len(edges) - 1
        before, after = (k - 1) % len(edges), (k + 1) % len(edges)
        if not closed:
            before, after = (after if k == 0 else k - 1), (before if k == last else k + 1)
        other = before if lengths[before] >= lengths[after] else after
        kinds[at] = kinds[edges[other]]
