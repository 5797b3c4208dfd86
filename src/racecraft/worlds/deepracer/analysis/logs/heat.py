"""Heat maps over the circuit: reward or any other column, for all actions or each. Begin with `reward_heat_map`.

The map has cells of CELL_M, whose mean is shown: a cell is coloured by all ticks in it, not by whichever came last.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, PlotError
from racecraft.worlds.deepracer.analysis.logs.actions import action_names, with_action_number
from racecraft.worlds.deepracer.analysis.logs.plot import (
    HEAT,
    WORDS,
    borders_above,
    colour_bar,
    limits_of,
    map_sheet,
    require,
    values,
)
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

CELL_M = 0.05
MAX_MAPS = 24
FEW = 3
"""A cell with fewer ticks tells little of what is chosen there, and is not drawn unless most have no more."""


def cells(ticks: pl.DataFrame | pl.LazyFrame, value: str = "reward", cell_m: float = CELL_M) -> pl.DataFrame:
    """Return the cells in which cars were: `x_m`, `y_m` (middle of the cell), `mean` of a column, `count` of ticks.

    Raises:
        PlotError: `cell_m` is not above 0, or there is no such column.
    """
    import polars as pl

    if not cell_m > 0:
        raise PlotError("A cell of {cell_m} m is no cell; expected more than 0.", cell_m=cell_m)
    frame = require(ticks, "x_m", "y_m", value)
    middle = [((pl.col(name) / cell_m).floor() * cell_m + cell_m / 2).alias(name) for name in ("x_m", "y_m")]
    grouped = frame.select(*middle, pl.col(value).cast(pl.Float64).alias("mean")).group_by("x_m", "y_m")
    return grouped.agg(pl.col("mean").mean(), pl.len().alias("count")).sort("y_m", "x_m")


def reward_heat_map(
    ticks: pl.DataFrame | pl.LazyFrame, track: Track, value: str = "reward", cell_m: float = CELL_M
) -> Plot:
    """Return where on the circuit how much was earned: `cells`, coloured by the mean of a column."""
    data = cells(ticks, value, cell_m)
    title = f"{WORDS.get(value, value)}, mean of each {100 * cell_m:.0f} cm cell".capitalize()
    return Plot("heat_map", title, data, lambda: _draw(track, [data], [""], cell_m, WORDS.get(value, value), "mean"))


def action_heat_maps(ticks: pl.DataFrame | pl.LazyFrame, track: Track, cell_m: float = 4 * CELL_M) -> Plot:
    """Return where each action was chosen: `action`, cell, `share` of the cell's ticks that chose it, `count`.

    Continuous actions are told apart by steering and speed in even bins (see `with_action_number`).
    """
    import polars as pl

    frame = with_action_number(ticks)
    names = action_names(frame)
    every = cells(frame, "reward", cell_m).select("x_m", "y_m", pl.col("count").alias("all"))
    each = []
    for number in list(names)[:MAX_MAPS]:
        chosen = cells(frame.filter(pl.col("action_number") == number), "reward", cell_m)
        share = (pl.col("count") / pl.col("all")).alias("share")
        each.append(
            chosen.join(every, on=["x_m", "y_m"]).select(
                pl.lit(number, pl.Int32).alias("action"), "x_m", "y_m", share, "count"
            )
        )
    data = pl.concat(each)
    titles = [names[number] for number in list(names)[:MAX_MAPS]]

    def draw() -> Any:
        least = min(FEW, float(every["all"].median()))  # type: ignore[arg-type]
        frequent = [one.filter((pl.col("count") / pl.col("share")).round() >= least) for one in each]
        most = limits_of(np.concatenate([values(one, "share")[0] for one in frequent]))[1]
        return _draw(track, frequent, titles, cell_m, "share of the cell's ticks", "share", (0.0, most))

    return Plot("action_heat_maps", "Where each action was chosen", data, draw)


def _draw(
    track: Track, each: list[pl.DataFrame], titles: list[str], cell_m: float, words: str, column: str,
    limits: tuple[float, float] | None = None,
) -> Any:  # fmt: skip
    figure, axes = map_sheet(track, len(each), titles, 1 if len(each) == 1 else 4)
    colour_limits = limits or limits_of(values(each[0], column)[0])
    painted = None
    x0, y0, x1, y1 = track.bounds
    middle_x, half_x = (x0 + x1) / 2, (x1 - x0) / 2 + track.width_mean
    middle_y, half_y = (y0 + y1) / 2, (y1 - y0) / 2 + track.width_mean
    for one, data in zip(axes, each, strict=True):
        x, y, shade = values(data, "x_m", "y_m", column)
        inside = (abs(x - middle_x) <= half_x) & (abs(y - middle_y) <= half_y)  # a damaged place may lie anywhere
        x, y, shade = x[inside], y[inside], shade[inside]
        borders_above(one, track)
        one.set_xlim(middle_x - half_x, middle_x + half_x)
        one.set_ylim(middle_y - half_y, middle_y + half_y)
        if not len(x):
            continue
        low_x, low_y = x.min(), y.min()
        across, up = np.rint((x - low_x) / cell_m).astype(int), np.rint((y - low_y) / cell_m).astype(int)
        image = np.full((up.max() + 1, across.max() + 1), np.nan)
        image[up, across] = shade
        half = cell_m / 2
        extent = (low_x - half, x.max() + half, low_y - half, y.max() + half)
        painted = one.imshow(
            image, origin="lower", extent=extent, cmap=HEAT, vmin=colour_limits[0], vmax=colour_limits[1], zorder=2,
            interpolation="nearest",
        )  # fmt: skip
    if painted is not None:
        colour_bar(figure, painted, axes, words)
    return figure
