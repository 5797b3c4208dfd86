"""Episodes told apart, whatever their numbers: over files, workers, evaluations and rounds. Begin with `number`.

An episode begins where the file, the number of the episode or the direction of the step counter changes. That holds
where numbers repeat (each worker counts from 0, each evaluation too) and where iterations differ in length, and needs
no assumption of how many episodes an iteration has.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.logs.columns import PHASES
from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.sources import Source

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


JUDGED_REWARDS = (0.0, 0.001, 0.1, 0.5, 1.0)
"""An evaluation pays by the original's own function of the centre line; 0 while held (simapp `defaults.py`)."""
MAX_TRIALS = 20
"""An evaluation has no more laps; a training's iteration has 20 episodes by default."""


def phase_of_rows(trace: pl.DataFrame, is_first: bool = True) -> str:
    """Return which phase rows without a telling path belong to.

    An evaluation has a few laps, all in a file of number 0, and pays by the original's own function. Where a training
    pays so too, the laps tell: a continuous evaluation drives on, and is held before its first lap only.

    Args:
        trace: Rows with AWS's names and `file`.
        is_first: Whether all files are an iteration 0, or have no number.
    """
    import polars as pl

    if "episode_status" not in trace.columns or not trace.height or not is_first:
        return PHASES[0]
    laps = trace.group_by("file", "episode", maintain_order=True).agg(
        (pl.col("episode_status").first() == "prepare").alias("held")
    )
    if laps.group_by("file").len()["len"].max() > MAX_TRIALS:  # type: ignore[operator]
        return PHASES[0]
    if not trace["reward"].round(6).is_in(JUDGED_REWARDS).all():
        return PHASES[0]
    later = laps.filter(pl.col("file") == pl.col("file").shift())
    return PHASES[1] if later.height and not later["held"].any() else PHASES[0]


def without_repeated_rows(ticks: pl.DataFrame, sources: Sequence[Source]) -> tuple[pl.DataFrame, list[Damage]]:
    """Leave out rows that stand there before; a file that was joined to itself, or copied beside itself, counts once.

    Args:
        ticks: With STREAM, `iteration`, `episode`, `tick`, `time_s`, `x_m`, `y_m`, `reward`, `file` and `line`.
        sources: The files.

    Returns:
        The rows that are left, and where the first repeated one of each file stands.
    """
    import polars as pl

    same = [
        name
        for name in (*STREAM, "iteration", "episode", "tick", "time_s", "x_m", "y_m", "reward")
        if name in ticks.columns
    ]
    if "time_s" not in same:
        return ticks, []
    repeated = ~ticks.select(pl.struct(same).is_first_distinct()).to_series()
    if not repeated.any():
        return ticks, []
    left_out = ticks.filter(repeated).group_by("file", maintain_order=True).agg(pl.len(), pl.col("line").first())
    damage = [
        Damage(sources[file].name, line, f"{count:,} rows stand there before; counted once")
        for file, count, line in left_out.iter_rows()
    ]
    return ticks.filter(~repeated), damage
