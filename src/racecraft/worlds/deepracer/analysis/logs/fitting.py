"""The line that was driven, as straights and arcs: log-guru's straight fitting and curve fitting. See `fitted_line`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, PlotError
from racecraft.contract.world import Array
from racecraft.pages.colours import ORANGE
from racecraft.worlds.deepracer.analysis.logs.episodes import simulation_agg
from racecraft.worlds.deepracer.analysis.logs.motion import with_motion
from racecraft.worlds.deepracer.analysis.logs.plot import WORDS, colour_bar, map_sheet, painted_path, values
from racecraft.worlds.deepracer.analysis.logs.segments import find_segments, in_segments
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

FEWEST_TICKS = 4
STRAIGHT_M = 30.0
"""An arc of this radius or more counts as a straight."""
CLEARLY = 0.5
"""So does one from which the path strays more than this share of what it strays from a line."""


def fitted_line(ticks: pl.DataFrame | pl.LazyFrame, track: Track, unique_episode: int | None = None) -> Plot:
    """Return one row a segment: the circle that fits the driven path best, and how far the path strays from it.

    Columns: `segment` (its name), `radius_m` (left positive; null for a straight), `heading_rad` (of a straight, from
    east, left positive; null for an arc), `stray_m` (root mean square), `fastest_mps` and `slowest_mps` (driven),
    `ticks`.

    Args:
        ticks: The ticks.
        track: The circuit.
        unique_episode: Which; None: the fastest full lap, or else the one that came farthest.

    Raises:
        PlotError: There is no such episode, or it is too short.
    """
    import polars as pl

    episode = _chosen(ticks, unique_episode)
    segments = find_segments(track)
    lap = in_segments(with_motion(ticks), track, segments).filter(pl.col("unique_episode") == episode)
    if not lap.height:
        raise PlotError("There is no episode {episode} among the ticks; expected one that is there.", episode=episode)
    rows = []
    for number, name in segments.names.items():
        part = lap.filter(pl.col("segment") == number)
        if part.height < FEWEST_TICKS:
            continue
        radius, heading, stray = fit(np.column_stack(values(part, "x_m", "y_m")))
        driven = values(part.drop_nulls("driven_mps"), "driven_mps")[0]
        ends = (float(driven.max()), float(driven.min())) if len(driven) else (math.nan, math.nan)
        rows.append((name, radius, heading, stray, *ends, part.height))
    if not rows:
        raise PlotError(
            "Episode {episode} has less than {fewest_ticks} ticks in each segment; choose a longer one.",
            episode=episode,
            fewest_ticks=FEWEST_TICKS,
        )
    columns = ("segment", "radius_m", "heading_rad", "stray_m", "fastest_mps", "slowest_mps", "ticks")
    data = pl.DataFrame(rows, schema=list(columns), orient="row")
    lap = lap.with_columns(pl.col("segment").replace_strict(segments.names, return_dtype=pl.String))
    return Plot("fitted_line", f"The line of episode {episode}", data, lambda: _draw(data, lap, track))


def fit(xy: Array) -> tuple[float | None, float | None, float]:
    """Return (radius, heading, stray) of the circle or straight through points (T, 2), in the order they were driven.

    The circle is that of least algebraic distance (Kåsa, "A circle fitting procedure and its error analysis", 1976),
    which a weaving path makes far too small; it is taken only where it fits clearly better than a line.
    """
    middle = xy.mean(axis=0)
    near = xy - middle
    matrix = np.column_stack([2.0 * near, np.ones(len(near))])
    (a, b, c), _, rank, _ = np.linalg.lstsq(matrix, (near**2).sum(axis=1), rcond=None)
    radius = math.sqrt(max(c + a * a + b * b, 0.0)) if rank == 3 else math.inf
    if not radius < STRAIGHT_M:
        return _straight(near)
    spokes = near - [a, b]
    swept = spokes[:-1, 0] * spokes[1:, 1] - spokes[:-1, 1] * spokes[1:, 0]  # counter-clockwise around the centre
    side = 1.0 if swept.sum() > 0 else -1.0
    stray = float(np.sqrt(((np.hypot(*spokes.T) - radius) ** 2).mean()))
    line = _straight(near)
    return (side * radius, None, stray) if stray <= CLEARLY * line[2] else line


def _straight(near: Array) -> tuple[None, float, float]:
    """Return the heading of the line through points around the origin, and how far they stray from it."""
    _, _, axes = np.linalg.svd(near, full_matrices=False)
    along = axes[0] * (1.0 if axes[0] @ (near[-1] - near[0]) >= 0 else -1.0)
    away = near @ np.array([-along[1], along[0]])
    return None, math.atan2(along[1], along[0]), float(np.sqrt((away**2).mean()))


def _chosen(ticks: pl.DataFrame | pl.LazyFrame, unique_episode: int | None) -> int:
    if unique_episode is not None:
        return unique_episode
    episodes = simulation_agg(ticks)
    full = episodes.filter(episodes["complete"])
    best = full.sort("seconds") if full.height else episodes.sort("progress_share", descending=True)
    return int(best["unique_episode"][0])


def _draw(data: pl.DataFrame, lap: pl.DataFrame, track: Track) -> Any:
    figure, (axes,) = map_sheet(track, 1, [""])
    xy = np.column_stack(values(lap, "x_m", "y_m"))
    speed = values(lap, "speed_mps")[0]
    painted = painted_path(axes, xy, speed, (0.0, max(0.1, float(speed.max()))))
    colour_bar(figure, painted, axes, WORDS["speed_mps"])
    for name, radius, _, stray, *_ in data.rows():
        at = values(lap.filter(lap["segment"] == name), "x_m", "y_m")
        shape = "straight" if radius is None else f"radius {abs(radius):.2f} m"
        words = f"{name}: {shape} ±{100 * stray:.0f} cm"
        axes.annotate(
            words, (float(np.median(at[0])), float(np.median(at[1]))), fontsize=8, color="#1d2327", ha="center",
            bbox={"fc": "white", "ec": ORANGE, "lw": 0.8, "pad": 1.5}, zorder=4,
        )  # fmt: skip
    return figure
