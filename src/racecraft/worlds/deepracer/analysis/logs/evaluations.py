"""Evaluations and submissions: every lap in a table and on the map. Begin with `evaluation_table`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from racecraft.analysis.plot import Plot, PlotError
from racecraft.worlds.deepracer.analysis.logs.episodes import simulation_agg
from racecraft.worlds.deepracer.analysis.logs.motion import with_motion
from racecraft.worlds.deepracer.analysis.logs.paths import _draw
from racecraft.worlds.deepracer.analysis.logs.plot import require
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

MAX_MAPS = 12


def evaluation_table(ticks: pl.DataFrame | pl.LazyFrame) -> pl.DataFrame:
    """Return one row a lap of every evaluation and submission, in order.

    Columns: `phase`, `stream`, `lap` (counted from 1), `unique_episode`, `progress_share`, `seconds`, `distance_m`,
    `speed_mps` (mean commanded: the notebooks' mean throttle), `driven_mps` (mean: their velocity), `off_track`,
    `crashed`, `complete`, `status`.

    Raises:
        PlotError: There is no evaluation among the ticks.
    """
    import polars as pl

    frame = require(ticks, "phase").filter(pl.col("phase") != "training")
    if not frame.height:
        raise PlotError("There is no evaluation among the ticks; expected at least one lap of one.")
    table = simulation_agg(frame)
    lap = (pl.col("unique_episode").rank("dense").over("round", "phase", "stream").cast(pl.Int32)).alias("lap")
    return table.with_columns(lap, (pl.col("distance_m") / pl.col("seconds")).alias("driven_mps")).select(
        "phase", "stream", "lap", "unique_episode", "progress_share", "seconds", "distance_m", "speed_mps",
        "driven_mps", "off_track", "crashed", "complete", "status",
    )  # fmt: skip


def evaluation_grid(ticks: pl.DataFrame | pl.LazyFrame, track: Track, value: str = "driven_mps") -> Plot:
    """Return every lap of the evaluations on a map of its own, coloured by a column; data: `evaluation_table`."""
    import polars as pl

    frame = with_motion(require(ticks, "phase").filter(pl.col("phase") != "training"))
    data = evaluation_table(frame)
    grids = data.head(MAX_MAPS)
    each = [frame.filter(pl.col("unique_episode") == number) for number in grids["unique_episode"]]
    titles = [
        f"Lap {lap}: {seconds:.2f} s, {100 * share:.0f} %"
        for lap, seconds, share in grids.select("lap", "seconds", "progress_share").rows()
    ]
    return Plot("evaluation_grid", "Laps of the evaluations", data, lambda: _draw(track, each, titles, value))
