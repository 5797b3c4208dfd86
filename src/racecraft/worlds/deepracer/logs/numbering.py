"""Episodes told apart, whatever their numbers: over files, workers, evaluations and rounds. Begin with `number`.

An episode begins where the file, the number of the episode or the direction of the step counter changes. That holds
where numbers repeat (each worker counts from 0, each evaluation too) and where iterations differ in length, and needs
no assumption of how many episodes an iteration has.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.logs.columns import PHASES

if TYPE_CHECKING:
    import polars as pl

STREAM = ("round", "phase", "stream", "worker")
"""What an episode may not reach over."""


def number(ticks: pl.DataFrame) -> pl.DataFrame:
    """Add `unique_episode` to rows that stand in order: each worker's one after the other within an iteration.

    A worker's episode that goes on in the file of its next iteration stays one as long as no other worker's rows stand
    between; those that do `continued.py` puts together.

    Args:
        ticks: With STREAM, `file`, `episode` and `tick`; round, phase and stream change where the file does, if at all.
    """
    import polars as pl

    rows = {name: ticks[name].to_numpy() for name in ("file", "worker", "episode", "tick")}
    begins = _changes(rows["episode"]) | _changes(rows["worker"])
    begins[1:] |= rows["tick"][1:] <= rows["tick"][:-1]
    files = np.flatnonzero(_changes(rows["file"]))  # only there the others may change, which are dearer to look at
    apart = ticks.select(STREAM)[files].select(pl.any_horizontal(pl.all().ne_missing(pl.all().shift())))
    begins[files[apart.to_series().to_numpy()]] = True
    first_rows = np.flatnonzero(begins)
    numbers = np.repeat(np.arange(len(first_rows), dtype=np.int32), np.diff(first_rows, append=ticks.height))
    return ticks.with_columns(pl.Series("unique_episode", numbers).set_sorted())


def _changes(values: Array) -> Array:
    """Tell which values differ from the one before; the first one does."""
    changes = np.ones(len(values), np.bool_)
    np.not_equal(values[1:], values[:-1], out=changes[1:])
    return changes


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
