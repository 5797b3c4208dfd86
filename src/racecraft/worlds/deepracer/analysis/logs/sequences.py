"""What follows what: the most frequent runs of actions. Begin with `action_sequences`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from racecraft.analysis.plot import Plot, PlotError, sheet
from racecraft.pages.colours import BLUE
from racecraft.worlds.deepracer.analysis.logs.actions import action_names, with_action_number
from racecraft.worlds.deepracer.analysis.logs.plot import name_axes, values

if TYPE_CHECKING:
    import polars as pl

LENGTH, MOST = 4, 20


def action_sequences(ticks: pl.DataFrame | pl.LazyFrame, length: int = LENGTH, most: int = MOST) -> Plot:
    """Return the most frequent sequences of actions within an episode.

    Columns: `sequence` (numbers with spaces between), `names` (what they are), `count`, `share` of all sequences of
    that length, `mean_reward` (of a tick in it). Continuous actions go by their bins (see `with_action_number`).

    Raises:
        PlotError: `length` is below 2, or no episode is that long.
    """
    import polars as pl

    if length < 2:
        raise PlotError("A sequence of {length} action is none; expected 2 or more.", length=length)
    frame = with_action_number(ticks)
    names = action_names(frame)
    follows = [pl.col("action_number").shift(-k).over("unique_episode").alias(f"_{k}") for k in range(length)]
    paid = sum((pl.col("reward").shift(-k).over("unique_episode") for k in range(length)), pl.lit(0.0)) / length
    runs = frame.with_columns(*follows, paid.alias("_paid")).drop_nulls([f"_{k}" for k in range(length)])
    if not runs.height:
        raise PlotError(
            "No episode has {length} actions; expected one that long. Ask for shorter sequences.", length=length
        )
    counted = runs.group_by([f"_{k}" for k in range(length)]).agg(
        pl.len().alias("count"), pl.col("_paid").mean().alias("mean_reward")
    )
    numbers = [f"_{k}" for k in range(length)]
    data = counted.sort(["count", *numbers], descending=[True, *[False] * length]).head(most)
    words = [", ".join(names[number].split(": ", 1)[1] for number in row) for row in data.select(numbers).rows()]
    data = data.with_columns(
        pl.concat_str(numbers, separator=" ").alias("sequence"),
        pl.Series("names", words),
        (pl.col("count") / runs.height).alias("share"),
    ).select("sequence", "names", "count", "share", "mean_reward")
    return Plot("action_sequences", f"The most frequent {length} actions in a row", data, lambda: _draw(data))


def _draw(data: pl.DataFrame) -> Any:
    figure, (axes,) = sheet(1, 1, ["Sequences, by the actions' numbers"], (7.0, 1.0 + 0.28 * data.height))
    axes.barh(range(data.height), 100 * values(data, "share")[0], color=BLUE, height=0.7)
    axes.set_yticks(range(data.height), data["sequence"].to_list(), fontsize=9)
    axes.invert_yaxis()
    name_axes(axes, "% of all sequences", "")
    return figure
