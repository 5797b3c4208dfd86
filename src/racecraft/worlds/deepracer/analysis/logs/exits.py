"""Where cars left the road. Begin with `exit_points`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from racecraft.analysis.plot import Plot, PlotError, sheet
from racecraft.pages.colours import RED
from racecraft.worlds.deepracer.analysis.drive import CRASHED, incidents
from racecraft.worlds.deepracer.analysis.logs.circuit import on_track
from racecraft.worlds.deepracer.analysis.logs.episodes import simulation_agg
from racecraft.worlds.deepracer.analysis.logs.plot import map_sheet, name_axes, values
from racecraft.worlds.deepracer.analysis.logs.segments import find_segments, in_segments
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

LEFT_THE_ROAD = ("off_track", "crashed", "immobilized", "reversed")
MARKS = {"off_track": "X", "crashed": "P", "immobilized": "s", "reversed": "v"}


def exit_points(ticks: pl.DataFrame | pl.LazyFrame, track: Track) -> Plot:
    """Return the places where episodes ended badly, and where a car was set back on the road.

    Columns: `unique_episode`, `iteration`, `status`, `x_m`, `y_m`, `waypoint` (of this track), `lap_share`, `segment`
    (its name), `speed_mps` and `steering_rad` (commanded in that tick).

    Raises:
        PlotError: No car left the road.
    """
    import polars as pl

    segments = find_segments(track)
    bad = on_track(ticks, track).filter(pl.col("status").is_in(LEFT_THE_ROAD).fill_null(False))
    if not bad.height:
        raise PlotError("No car left the road here; expected at least one that did. There is nothing to draw.")
    bad = bad.group_by("unique_episode", pl.struct("unique_episode", "status").rle_id().alias("_run"),
                       maintain_order=True).first()  # fmt: skip
    bad = in_segments(bad, track, segments)
    data = bad.select("unique_episode", "iteration", "status", "x_m", "y_m", "waypoint", "lap_share",
                      pl.col("segment").replace_strict(segments.names, return_dtype=pl.String), "speed_mps",
                      "steering_rad")  # fmt: skip
    grief = incidents(data["status"].unique()) or "came to grief"
    title = f"Where cars {grief}, {data.height} times"
    return Plot("exit_points", title, data, lambda: _draw(data, track))


def exits_by_segment(ticks: pl.DataFrame | pl.LazyFrame, track: Track) -> pl.DataFrame:
    """Return the segments with most exits first: `segment` (its name), `exits`, `crashes` (exits that ran
    into something), `share` of all exits, `speed_mps` (mean), `passed_share` (share of the episodes that reached the
    segment and did not end there).
    """  # noqa: D205
    import polars as pl

    points = exit_points(ticks, track).data
    segments = find_segments(track)
    reached = in_segments(ticks, track, segments).group_by(pl.col("segment").alias("_place")).agg(
        pl.col("unique_episode").n_unique().alias("reached"),
        pl.col("segment").first().replace_strict(segments.names, return_dtype=pl.String),
    )  # fmt: skip
    counted = points.group_by("segment").agg(
        pl.len().alias("exits"), (pl.col("status") == CRASHED).sum().alias("crashes"), pl.col("speed_mps").mean()
    )
    return (
        counted.join(reached, on="segment")
        .with_columns(
            (pl.col("exits") / points.height).alias("share"),
            (1.0 - pl.col("exits") / pl.col("reached")).clip(0.0).alias("passed_share"),
        )
        .sort("exits", "_place", descending=[True, False])
        .select("segment", "exits", "crashes", "share", "speed_mps", "passed_share")
    )


def exits_by_segment_plot(ticks: pl.DataFrame | pl.LazyFrame, track: Track) -> Plot:
    """Return `exits_by_segment` as bars.

    Raises:
        PlotError: No car left the road.
    """
    data = exits_by_segment(ticks, track)
    return Plot("exits_by_segment", "Exits by segment", data, lambda: _draw_segments(data))


def endings(ticks: pl.DataFrame | pl.LazyFrame) -> pl.DataFrame:
    """Return how episodes ended, most frequent first: `status`, `episodes`, `share`."""
    import polars as pl

    episodes = simulation_agg(ticks)
    counted = episodes.group_by("status").agg(pl.len().alias("episodes"))
    return counted.with_columns((pl.col("episodes") / episodes.height).alias("share")).sort(
        "episodes", "status", descending=[True, False]
    )


def _draw_segments(data: pl.DataFrame) -> Any:
    figure, (axes,) = sheet(1, 1, ["Exits in each segment"], (7.0, 1.0 + 0.34 * data.height))
    axes.barh(range(data.height), values(data, "exits")[0], color=RED, height=0.7)
    words = [f"{name}, {100 * share:.0f} % pass" for name, share in data.select("segment", "passed_share").rows()]
    axes.set_yticks(range(data.height), words, fontsize=9)
    axes.invert_yaxis()
    name_axes(axes, "exits", "")
    return figure


def _draw(data: pl.DataFrame, track: Track) -> Any:
    figure, (axes,) = map_sheet(track, 1, [""])
    for status, mark in MARKS.items():
        rows = data.filter(data["status"] == status)
        if rows.height:
            axes.scatter(*values(rows, "x_m", "y_m"), s=28, marker=mark, color=RED, alpha=0.45, lw=0, zorder=3,
                         label=f"{status.replace('_', ' ')} ({rows.height})")  # fmt: skip
    axes.legend(frameon=False, fontsize=9, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(MARKS))
    return figure
