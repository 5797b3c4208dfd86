"""Episodes told apart, whatever their numbers: over files, workers, evaluations and rounds. Begin with `number`.

An episode begins where the file, the number of the episode or the direction of the step counter changes. That holds
where numbers repeat (each worker counts from 0, each evaluation too) and where iterations differ in length, and needs
no assumption of how many episodes an iteration has.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from racecraft.logs.columns import PHASES

if TYPE_CHECKING:
    import polars as pl

STREAM = ("round", "phase", "stream", "worker")
"""What an episode may not reach over."""


def number(ticks: pl.DataFrame) -> pl.DataFrame:
    """Add `unique_episode` to rows that stand in order: each worker's one after the other within an iteration.

    A worker's episode that goes on in the file of its next iteration stays one as long as no other worker's rows stand
    between; those that do `continued.py` puts together.
    """
    import polars as pl

    changed = [pl.col(name).ne_missing(pl.col(name).shift()) for name in (*STREAM, "episode")]
    begins = pl.any_horizontal(*changed, pl.col("tick") <= pl.col("tick").shift()).fill_null(True)
    first_rows = ticks.select(begins.arg_true()).to_series().to_numpy()
    numbers = np.repeat(np.arange(len(first_rows), dtype=np.int32), np.diff(first_rows, append=ticks.height))
    return ticks.with_columns(pl.Series("unique_episode", numbers).set_sorted())


def phase_of_rows(trace: pl.DataFrame) -> str:
    """Return which phase rows without a telling path belong to.

    In a training every episode begins with a row "prepare", in which the car is held; an evaluation drives on from lap
    to lap and is held before the first only. What has but one episode, or was cut off before the second, counts as
    training.
    """
    import polars as pl

    if "episode_status" not in trace.columns or not trace.height:
        return PHASES[0]
    laps = trace.group_by("file", "episode", maintain_order=True).agg(
        (pl.col("episode_status").first() == "prepare").alias("held")
    )
    later = laps.filter(pl.col("file") == pl.col("file").shift())
    return PHASES[1] if later.height and not later["held"].any() else PHASES[0]
