"""Whether the simulator kept its pace: the times between steps. Begin with `stability`.

The original decides fifteen times a second. Where steps took longer, the car learned to drive with a later hand; the
community's rule calls more than 70 ms on average or 90 ms in one step of twenty trouble (facts: deepracer-utils).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from racecraft.analysis.plot import Plot, sheet
from racecraft.pages.colours import BLUE, ORANGE, RED
from racecraft.worlds.deepracer.analysis.logs.plot import name_axes, only, values

if TYPE_CHECKING:
    import polars as pl

MEAN_MS, P95_MS = 70.0, 90.0


def stability(ticks: pl.DataFrame | pl.LazyFrame) -> Plot:
    """Return the stability table: one row an iteration and worker.

    Columns: round, phase, stream, iteration, worker, `steps`, `mean_ms`, `std_ms`, `p95_ms`, `max_ms` between steps of
    an episode in simulated time; `real_time_factor` (simulated over real seconds, null without a wall clock); `steady`.
    """
    import polars as pl

    frame = only(
        ticks, "unique_episode", "time_s", "status", "round", "phase", "stream", "iteration", "worker", "wall_clock_s"
    )
    same = pl.col("unique_episode") == pl.col("unique_episode").shift()
    step = pl.col("time_s") - pl.col("time_s").shift()
    wall = pl.col("wall_clock_s") - pl.col("wall_clock_s").shift()
    held = (pl.col("status") == "prepare").fill_null(False)
    steps = frame.select(
        "round", "phase", "stream", "iteration", "worker",
        (1000.0 * pl.when(same & ~held & (step >= 0)).then(step)).alias("ms"),
        pl.when((step >= 0) & (wall > 0)).then(step).alias("simulated"),
        pl.when((step >= 0) & (wall > 0)).then(wall).alias("real"),
    )  # fmt: skip
    data = steps.group_by("round", "phase", "stream", "iteration", "worker", maintain_order=True).agg(
        pl.col("ms").count().alias("steps"),
        pl.col("ms").mean().alias("mean_ms"),
        pl.col("ms").std(ddof=0).alias("std_ms"),
        pl.col("ms").quantile(0.95, "linear").alias("p95_ms"),
        pl.col("ms").max().alias("max_ms"),
        (pl.col("simulated").sum() / pl.when(pl.col("real").sum() > 0).then(pl.col("real").sum())).alias(
            "real_time_factor"
        ),
    )
    data = data.with_columns(((pl.col("mean_ms") <= MEAN_MS) & (pl.col("p95_ms") <= P95_MS)).alias("steady"))
    return Plot("stability", "Time between steps", data, lambda: _draw(data))


def _draw(data: pl.DataFrame):
    import numpy as np

    figure, (axes,) = sheet(1, 1, ["Time between steps, by iteration"], (7.0, 3.2))
    mean, p95, most = values(data, "mean_ms", "p95_ms", "max_ms")
    at = np.arange(len(mean))
    axes.plot(at, mean, color=BLUE, lw=1.8, label="mean")
    axes.plot(at, p95, color=ORANGE, lw=1.4, ls="--", label="19 of 20 within")
    axes.plot(at, most, color=RED, lw=0.8, ls=":", label="longest")
    axes.axhline(P95_MS, color=RED, lw=0.8, alpha=0.5)
    axes.set_ylim(0, max(1.6 * P95_MS, 1.2 * float(np.nan_to_num(p95).max())))  # of one step there is none
    name_axes(axes, "iteration", "ms")
    axes.legend(frameon=False, fontsize=9)
    return figure
