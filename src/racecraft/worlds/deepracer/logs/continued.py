"""Episodes that go on in a later iteration, as one. Begin with `join_continued`.

AWS's trainings end an iteration with an episode. Those that collect so many steps of many cars side by side cut it
wherever each car is: a car's episode then goes on in the file of the next iteration, behind the rows of all other cars.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from racecraft.worlds.deepracer.logs.columns import PHASES
from racecraft.worlds.deepracer.logs.numbering import STREAM

if TYPE_CHECKING:
    import polars as pl


def join_continued(ticks: pl.DataFrame) -> pl.DataFrame:
    """Give all parts of an episode its `unique_episode`, and put their rows one behind the other.

    A part goes on with the one before it of the same car when its episode has the same number and its steps count on.
    Only trainings are looked at. Each row keeps its iteration.

    Args:
        ticks: With `unique_episode`, each part of an episode counted by itself, in order.
    """
    import polars as pl

    training = pl.col("phase") == PHASES[0]
    begins = (pl.col("unique_episode") != pl.col("unique_episode").shift()).fill_null(True)
    if not ticks.select((begins & training & (pl.col("tick") > 1)).any()).item():
        return ticks
    parts = ticks.group_by("unique_episode", maintain_order=True).agg(
        *(pl.col(name).first() for name in (*STREAM, "episode")),
        pl.col("tick").first().alias("from"), pl.col("tick").last().alias("to"),
    )  # fmt: skip
    before = {"episode": "episode_before", "to": "before"}
    parts = parts.with_columns(pl.col(name).shift().over(*STREAM).alias(alias) for name, alias in before.items())
    goes_on = training & (pl.col("episode_before") == pl.col("episode")) & (pl.col("before") + 1 == pl.col("from"))
    parts = parts.with_columns((~goes_on.fill_null(False)).alias("begins"))
    parts = parts.with_columns(pl.col("begins").cum_sum().over(*STREAM).alias("whole"))
    first = parts.with_columns(pl.col("unique_episode").min().over(*STREAM, "whole").alias("first"))
    one = first.select("unique_episode", (pl.col("first").rank("dense") - 1).cast(pl.Int32).alias("one"))
    joined = ticks.join(one, on="unique_episode", how="left", maintain_order="left")
    return joined.with_columns(pl.col("one").alias("unique_episode")).drop("one").sort(
        "unique_episode", maintain_order=True
    )  # fmt: skip
