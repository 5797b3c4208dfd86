"""Along the lap: what was earned, and how fast it was, at each waypoint. Begin with `reward_per_waypoint`.

Waypoints are the rows of the track at hand, found from x and y; a log whose simulator counted other rows fits as well.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, sheet
from racecraft.pages.colours import BLUE, ORANGE
from racecraft.worlds.deepracer.analysis.logs.circuit import on_track
from racecraft.worlds.deepracer.analysis.logs.plot import name_axes, values
from racecraft.worlds.deepracer.analysis.logs.segments import COLOURS, find_segments
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl


def reward_per_waypoint(ticks: pl.DataFrame | pl.LazyFrame, track: Track) -> Plot:
    """Return one row a waypoint.

    Columns: `waypoint`, `lap_share`, `count`, `reward` (mean of a tick), `reward_std`, `speed_mps` (mean commanded),
    `offset_m` (mean, left positive). Waypoints nobody passed have no row.
    """
    import polars as pl

    frame = on_track(ticks, track)
    last = len(track.centre) - 1
    row = pl.when(pl.lit(track.closed) & (pl.col("waypoint") == last)).then(0).otherwise(pl.col("waypoint"))
    grouped = frame.filter((pl.col("status") != "prepare").fill_null(True)).group_by(row.alias("waypoint"))
    data = grouped.agg(
        pl.len().alias("count"), pl.col("reward").mean().alias("reward"), pl.col("reward").std().alias("reward_std"),
        pl.col("speed_mps").mean(), pl.col("offset_m").mean(),
    ).sort("waypoint")  # fmt: skip
    share = track.arc[data["waypoint"].to_numpy()] / track.length
    data = data.with_columns(pl.Series("lap_share", share))
    return Plot("reward_per_waypoint", "Reward and speed along the lap", data, lambda: _draw(data, track))


def _draw(data: pl.DataFrame, track: Track) -> Any:
    figure, axes = sheet(2, 1, ["Mean reward of a tick", "Mean commanded speed"], (9.0, 2.5))
    rows = np.arange(len(track.centre))
    reward, speed = np.full((2, len(rows)), np.nan)
    reward[data["waypoint"]], speed[data["waypoint"]] = values(data, "reward", "speed_mps")
    edges = np.arange(len(rows) + 1) - 0.5
    axes[0].stairs(reward, edges, color=BLUE, fill=True)
    axes[1].stairs(speed, edges, baseline=None, color=ORANGE, lw=1.6)
    for one, words in zip(axes, ("", "m/s"), strict=True):
        for segment in find_segments(track).all:
            inside = np.flatnonzero(find_within(track.arc / track.length, segment.begin, segment.end))
            for run in np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1):
                if len(run):
                    one.axvspan(rows[run[0]] - 0.5, rows[run[-1]] + 0.5, ymax=0.03, color=COLOURS[segment.kind], lw=0)
        one.set_xlim(-1, len(track.centre))
        name_axes(one, "waypoint (blue: left curves, orange: right curves)", words)
    return figure


def find_within(share: Any, begin: float, end: float) -> Any:
    """Tell which shares of the lap lie from begin to end, across the start line where begin is not below end."""
    if begin < end:
        return (share >= begin) & (share < end)
    return (share >= begin) | (share < end)
