"""What the plots of a log share: columns they require, axes, and the plan of a circuit. Begin with `plan`.

Charts are drawn on `analysis.plot.sheet`, maps on `plan`, which leaves the ground white so that a page can be printed.
Colours are Okabe and Ito's and matplotlib's cividis. In grey two of the former may be one, so what stands in one panel
differs by its line or mark too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import PlotError, sheet
from racecraft.contract.world import Array
from racecraft.pages.colours import GREEN, INK, QUIET
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

HEAT = "cividis"
ROAD = "#e3e7ea"
SET_BACK, SET_BACK_M = 5.0, 0.3
"""A step of more than so many usual ones of its episode, and so many metres, was not driven: the car was set down."""
MAX_DOTS = 20_000
"""Dots drawn in one panel; of more a sample, taken evenly."""


def was_set_down(episode: pl.Series, step_m: pl.Series) -> pl.Series:
    """Return in which ticks a car was not driven but set down elsewhere (see SET_BACK), by its steps in metres.

    Few episodes have a long step at all, and only theirs are looked at.
    """
    import polars as pl

    steps = pl.DataFrame({"episode": episode, "step": step_m, "long": (step_m > SET_BACK_M).fill_null(False)})
    suspect = steps.filter(pl.col("episode").is_in(episode.filter(steps["long"]).unique().implode()))
    usual = suspect.group_by("episode").agg(pl.col("step").median().alias("usual"))
    long = steps.with_row_index().filter("long").join(usual, on="episode", how="left")
    down = np.zeros(steps.height, bool)
    down[long.filter(pl.col("step") > SET_BACK * pl.col("usual"))["index"].to_numpy()] = True
    return pl.Series("set_down", down)


def require(ticks: pl.DataFrame | pl.LazyFrame, *columns: str) -> pl.DataFrame:
    """Return the ticks as a frame that is there, with rows and columns.

    Raises:
        PlotError: There are no rows, or a column is missing.
    """
    import polars as pl

    frame = ticks.collect() if isinstance(ticks, pl.LazyFrame) else ticks
    _must_have(frame.columns, columns)
    if not frame.height:
        raise PlotError("There are no ticks here; expected at least one. Choose another episode, iteration or phase.")
    return frame


def only(ticks: pl.DataFrame | pl.LazyFrame, *columns: str) -> pl.DataFrame:
    """Return these columns of the ticks, as `require` does; of a lazy table nothing else is read.

    Raises:
        PlotError: There are no rows, or a column is missing.
    """
    _must_have(ticks.collect_schema().names(), columns)
    return require(ticks.select(columns))


def _must_have(found: Sequence[str], columns: Sequence[str]) -> None:
    missing = [name for name in columns if name not in found]
    if missing:
        raise PlotError(
            "The ticks have no column {missing}; found {found}. `racecraft.worlds.deepracer.logs.read` gives them all.",
            missing=", ".join(missing),
            found=", ".join(found) or "none",
        )


COUNTED = ("iteration", "episode", "step", "waypoint")


def name_axes(axes: Any, across: str, up: str) -> None:
    """Write what the axes show, with units; where something is counted, in whole numbers."""
    from matplotlib.ticker import MaxNLocator

    marks = axes.xaxis.get_major_locator()
    if across.startswith(COUNTED) and isinstance(marks, MaxNLocator):  # not where each mark has a word of its own
        marks.set_params(integer=True)
    axes.set_xlabel(across, fontsize=9, color=QUIET)
    axes.set_ylabel(up, fontsize=9, color=QUIET)


def nothing(axes: Any, words: str) -> None:
    """Say in words what a chart without a single value would not tell."""
    axes.text(0.5, 0.5, words, transform=axes.transAxes, ha="center", va="center", fontsize=10, color=QUIET)
    axes.set_xticks([])
    axes.set_yticks([])


def map_sheet(track: Track, count: int, titles: Sequence[str], most_columns: int = 3) -> tuple[Any, list]:
    """Return a figure with `count` plans of a circuit and the list of their axes."""
    x0, y0, x1, y1 = track.bounds
    columns = min(count, most_columns)
    rows = -(-count // columns)
    width = 9.0 if count == 1 else 12.0 / columns
    height = min(1.6 * width, max(0.35 * width, width * (y1 - y0) / (x1 - x0))) + 0.4
    figure, axes = sheet(rows, columns, titles, (width, height))
    for one in axes:
        plan(one, track, numbers=count == 1)
    return figure, axes


def plan(axes: Any, track: Track, numbers: bool = True) -> None:
    """Draw a circuit in quiet lines on white: road, borders, start and, if wanted, every tenth waypoint's number."""
    closed = track.closed
    for line, style in ((track.inner, "-"), (track.outer, "-"), (track.centre, (0, (4, 4)))):
        axes.plot(*line.T, color=QUIET, lw=0.9 if style == "-" else 0.6, ls=style, zorder=1.5)
    ring = np.concatenate([track.outer, track.inner[::-1]])
    axes.fill(*ring.T, color=ROAD, lw=0, zorder=1)
    at = track.locate(track.centre[:1])
    axes.plot(*np.array([at.inner_point[0], at.outer_point[0]]).T, color=INK, lw=2.2, zorder=1.8)
    ahead, size = track.pose_at(0.3 * track.width_mean), 0.5 * track.width_mean
    axes.annotate(
        "", (ahead.x + size * np.cos(ahead.yaw), ahead.y + size * np.sin(ahead.yaw)),
        (ahead.x, ahead.y), arrowprops={"arrowstyle": "-|>", "color": INK}, zorder=1.9,
    )  # fmt: skip
    if numbers:
        rows = np.arange(0, len(track.centre) - (1 if closed else 0), max(1, len(track.centre) // 12))
        if closed and track.length - track.arc[rows[-1]] < track.width_mean:
            rows = rows[:-1]  # its number would lie on that of the first
        border = track.locate(track.centre[rows]).outer_point
        away = border - track.centre[rows]
        away /= np.maximum(np.hypot(*away.T)[:, None], 1e-9)
        for row, (x, y) in zip(rows, border + 0.25 * track.width_mean * away, strict=True):
            axes.text(x, y, str(row), fontsize=8, color=QUIET, ha="center", va="center", zorder=1.6)
    axes.set_aspect("equal")
    axes.set_axis_off()


def borders_above(axes: Any, track: Track) -> None:
    """Draw the road's borders once more, above what covers them, to be seen on dark and bright cells alike."""
    for line in (track.inner, track.outer):
        for colour, wide in (("white", 2.4), (INK, 0.9)):
            axes.plot(*line.T, color=colour, lw=wide, zorder=2.5)


def colour_bar(figure: Any, painted: Any, axes: Any, label: str) -> None:
    """Put a slim bar of colours beside axes."""
    bar = figure.colorbar(painted, ax=axes, fraction=0.03, pad=0.02)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=8, colors=INK, length=0)
    bar.set_label(label, fontsize=9, color=INK)


def painted_path(axes: Any, xy: Array, value: Array, limits: tuple[float, float], wide: float = 2.2) -> Any:
    """Lay a path (T, 2) over a plan, coloured by a value (T,); return what a colour bar needs.

    Where the car was set down elsewhere the path is broken, for no car drove there.
    """
    from matplotlib.collections import LineCollection

    step = np.hypot(*np.diff(xy, axis=0).T)
    driven = step <= max(SET_BACK_M, SET_BACK * float(np.median(step)))
    pieces = np.stack([xy[:-1], xy[1:]], axis=1)[driven]
    lines = LineCollection(list(pieces), cmap=HEAT, linewidths=wide, zorder=3)
    lines.set_array(((value[:-1] + value[1:]) / 2)[driven])
    lines.set_clim(*limits)
    axes.add_collection(lines)
    return lines


def limits_of(value: Array) -> tuple[float, float]:
    """Return between which values the colours lie: 98 of 100 of them."""
    low, high = np.nanpercentile(value, (1, 99)) if len(value) else (0.0, 1.0)
    return float(low), float(high if high > low else low + 1e-9)


def histogram(
    axes: Any, value: Array, bins: int, colour: str = GREEN, limits: tuple[float, float] | None = None
) -> None:
    """Draw how values spread; values that are all the same stand in one bar."""
    value = value[np.isfinite(value)]
    axes.hist(value, bins=bins, range=limits or spread_limits(value), color=colour, edgecolor="white", lw=0.4)


def spread_limits(value: Array) -> tuple[float, float]:
    """Return the ends of a histogram's bins, which lie apart although all values may be the same."""
    low, high = (float(value.min()), float(value.max())) if len(value) else (0.0, 1.0)
    return (low, high) if high - low > 1e-9 * max(1.0, abs(high)) else (low - 0.5, low + 0.5)


def few(frame: pl.DataFrame, most: int = MAX_DOTS) -> pl.DataFrame:
    """Return at most so many rows, taken evenly."""
    return frame if frame.height <= most else frame.gather_every(-(-frame.height // most))


def values(frame: pl.DataFrame, *names: str) -> tuple[Array, ...]:
    """Return columns as float arrays, null as NaN."""
    import polars as pl

    return tuple(frame[name].cast(pl.Float64).to_numpy() for name in names)


WORDS = {
    "reward": "reward", "speed_mps": "commanded speed (m/s)", "steering_rad": "steering (rad, left positive)",
    "driven_mps": "driven speed (m/s)", "slide_rad": "slide (rad)", "progress_share": "progress (share of the lap)",
}  # fmt: skip
"""What a column is called on an axis."""
