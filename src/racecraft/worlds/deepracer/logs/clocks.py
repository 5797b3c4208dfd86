"""Clocks that jump: where simulated time runs backwards or leaps within an episode. Begin with `jumps`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from racecraft.worlds.deepracer.logs.errors import Damage

if TYPE_CHECKING:
    import polars as pl

LEAP_S = 2.0
"""Two ticks of one episode are a fifteenth of a second apart; a leap is thirty times that, pauses aside."""
MAX_NAMED = 20


def jumps(ticks: pl.DataFrame, files: Sequence[str]) -> list[Damage]:
    """Return where the clock jumps; the rows stay as they are.

    Args:
        ticks: The table of ticks.
        files: Names of the files, as `file` counts them.
    """
    import polars as pl

    gap = pl.col("time_s") - pl.col("time_s").shift()
    here = pl.col("unique_episode") == pl.col("unique_episode").shift()
    pause = pl.col("pause_s").fill_null(0.0)
    found = ticks.select("file", "line", gap.alias("gap"), (here & ((gap < 0) | (gap > LEAP_S + pause))).alias("odd"))
    odd = found.filter(pl.col("odd"))
    lines = [
        Damage(files[file], line, f"the clock {_jump(gap)} within an episode; kept")
        for file, line, gap in odd.head(MAX_NAMED).select("file", "line", "gap").iter_rows()
    ]
    if odd.height > MAX_NAMED:
        lines.append(Damage(files[odd["file"][-1]], None, f"the clock jumps {odd.height - MAX_NAMED} more times"))
    return lines


def _jump(gap: float) -> str:
    return f"runs back by {-gap:.3f} s" if gap < 0 else f"leaps by {gap:.3f} s"
