"""Full laps: their times and their sectors, and what goes with a fast one. Begin with `lap_correlations`.

Sectors are the circuit's segments (see `segments.py`), or so many even parts of the lap.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, PlotError, sheet
from racecraft.contract.world import Array
from racecraft.pages.colours import BLUE, GREEN, ORANGE
from racecraft.worlds.deepracer.analysis.logs.circuit import on_track
from racecraft.worlds.deepracer.analysis.logs.episodes import simulation_agg
from racecraft.worlds.deepracer.analysis.logs.motion import with_motion
from racecraft.worlds.deepracer.analysis.logs.plot import few, histogram, name_axes, values
from racecraft.worlds.deepracer.analysis.logs.segments import find_segments
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

CAUSES = (
    "steps", "distance_m", "speed_mps", "reward", "reward_per_step", "driven_mps", "top_mps", "slide_rad",
    "steering_rad", "steering_changes",
)  # fmt: skip
"""What is set beside the time of a lap; slide and steering are means of their size."""
CALLED = {
    "distance_m": "distance (m)", "speed_mps": "commanded speed (m/s)", "reward_per_step": "reward of a step",
    "driven_mps": "driven speed (m/s)", "top_mps": "top speed (m/s)", "slide_rad": "slide (°)",
    "steering_rad": "steering (°)", "steering_changes": "changes of steering",
}  # fmt: skip


def lap_times(ticks: pl.DataFrame | pl.LazyFrame) -> Plot:
    """Return how the times of full laps spread: `simulation_agg`'s rows of full laps, fastest first.

    Raises:
        PlotError: There is no full lap.
    """
    episodes = simulation_agg(ticks)
    data = episodes.filter(episodes["complete"]).sort("seconds", "unique_episode")
    if not data.height:
        raise PlotError("There is no full lap here; expected one at least. Let the training go on.")
    share = 100 * data.height / episodes.height
    title = f"{data.height} full laps of {episodes.height} episodes ({share:.1f} %)"
    return Plot("lap_times", title, data, lambda: _draw_times(data))


def lap_features(ticks: pl.DataFrame | pl.LazyFrame) -> pl.DataFrame:
    """Return the full laps with what goes with them: `simulation_agg`'s columns and the rest of CAUSES."""
    import polars as pl

    frame = with_motion(ticks)
    episodes = simulation_agg(frame)
    more = frame.group_by("unique_episode").agg(
        pl.col("driven_mps").mean(),
        pl.col("driven_mps").max().alias("top_mps"),
        pl.col("slide_rad").abs().mean(),
        pl.col("steering_rad").abs().mean(),
        (pl.col("steering_rad") != pl.col("steering_rad").shift()).sum().alias("steering_changes"),
    )
    return episodes.filter(episodes["complete"]).join(more, on="unique_episode", maintain_order="left")


def lap_correlations(ticks: pl.DataFrame | pl.LazyFrame) -> Plot:
    """Return how the time of full laps goes with what the car did: `feature`, `correlation` (Pearson, -1 to 1), `laps`.

    A correlation near 1 means slow laps have much of it. Strongest first; null where a feature does not vary.

    Raises:
        PlotError: There are fewer than three full laps.
    """
    import polars as pl

    laps = lap_features(ticks)
    if laps.height < 3:
        raise PlotError(
            "There are {height} full laps; expected three at least. Let the training go on.", height=laps.height
        )
    coefficients = [(name, correlation(*values(laps, "seconds", name)), laps.height) for name in CAUSES]
    data = pl.DataFrame(
        coefficients, schema={"feature": pl.String, "correlation": pl.Float64, "laps": pl.Int64}, orient="row"
    )
    data = data.sort(pl.col("correlation").abs(), descending=True, nulls_last=True)
    return Plot("lap_correlations", "What goes with a slow lap", data, lambda: _draw_correlations(data, laps))


def sector_times(ticks: pl.DataFrame | pl.LazyFrame, track: Track, parts: int | None = None) -> Plot:
    """Return the time of each sector of each full lap: `unique_episode`, `sector`, `seconds`, `lap_seconds`.

    A sector that is a segment has the segment's name, else it is "sector 1" and so on.

    Args:
        ticks: The ticks.
        track: The circuit.
        parts: Even parts of the lap; None: the segments that the curvature tells.

    Raises:
        PlotError: There is no full lap.
    """
    import polars as pl

    frame = on_track(ticks, track)
    episodes = simulation_agg(frame)
    laps = episodes.filter(episodes["complete"])
    if not laps.height:
        raise PlotError("There is no full lap here; expected one at least. Let the training go on.")
    frame = frame.join(laps.select("unique_episode", pl.col("seconds").alias("lap_seconds")), on="unique_episode")
    sector, names = _sectors(track, parts, frame["lap_share"].to_numpy())
    step = pl.col("time_s") - pl.col("time_s").shift().over("unique_episode")
    data = (
        frame.with_columns(pl.Series("sector", sector), step.fill_null(0.0).alias("_step"))
        .group_by("unique_episode", "sector", maintain_order=True)
        .agg(pl.col("_step").sum().alias("seconds"), pl.col("lap_seconds").first())
        .sort("unique_episode", "sector")
        .select(
            "unique_episode", pl.col("sector").replace_strict(names, return_dtype=pl.String), "seconds", "lap_seconds"
        )
    )
    driven = set(data["sector"])
    order = [name for name in names.values() if name in driven]
    return Plot("sector_times", "Sector times of full laps", data, lambda: _draw_sectors(data, order))


def sector_correlations(ticks: pl.DataFrame | pl.LazyFrame, track: Track, parts: int | None = None) -> pl.DataFrame:
    """Return one row a sector: `sector`, `best_seconds`, `mean_seconds`, `lost_seconds` (mean less best),
    `correlation` with the time of the lap; most lost first.
    """  # noqa: D205
    import polars as pl

    data = sector_times(ticks, track, parts).data
    rows = []
    for (sector,), group in data.group_by("sector", maintain_order=True):
        seconds, lap = values(group, "seconds", "lap_seconds")
        mean, best = seconds.mean(), seconds.min()
        rows.append((sector, best, mean, mean - best, correlation(seconds, lap)))
    names = ("sector", "best_seconds", "mean_seconds", "lost_seconds", "correlation")
    return pl.DataFrame(rows, schema=list(names), orient="row").sort("lost_seconds", descending=True)


def sector_losses(ticks: pl.DataFrame | pl.LazyFrame, track: Track, parts: int | None = None) -> Plot:
    """Return `sector_correlations` as bars: what full laps lose in each sector to the best.

    Raises:
        PlotError: There is no full lap.
    """
    data = sector_correlations(ticks, track, parts)
    return Plot("sector_losses", "Time lost in each sector", data, lambda: _draw_losses(data))


def correlation(a: Any, b: Any) -> float | None:
    """Return Pearson's correlation; None where one of them does not vary."""
    there = np.isfinite(a) & np.isfinite(b)
    a, b = a[there], b[there]
    if len(a) < 3 or a.std() < 1e-12 or b.std() < 1e-12:
        return None
    return float(np.corrcoef(a, b)[0, 1])


def _sectors(track: Track, parts: int | None, lap_share: Array) -> tuple[Array, dict[int, str]]:
    """Return the index of the sector at shares of the lap (T,), and the names by index in driving order."""
    if parts is None:
        segments = find_segments(track)
        return segments.of(lap_share), segments.names
    if parts < 1:
        raise PlotError("A lap has no {parts} sectors; expected 1 or more.", parts=parts)
    return np.minimum(lap_share * parts, parts - 1).astype(int), {k: f"sector {k + 1}" for k in range(parts)}


def _draw_losses(data: pl.DataFrame) -> Any:
    figure, (axes,) = sheet(
        1, 1, ["Lost to the best, mean of full laps; correlation with the lap's time"], (7.0, 1.0 + 0.34 * data.height)
    )
    axes.barh(range(data.height), values(data, "lost_seconds")[0], color=ORANGE, height=0.7)
    words = [
        name if coefficient is None else f"{name} ({coefficient:+.2f})"
        for name, coefficient in data.select("sector", "correlation").rows()
    ]
    axes.set_yticks(range(data.height), words, fontsize=9)
    axes.invert_yaxis()
    name_axes(axes, "s", "")
    return figure


def _draw_times(data: pl.DataFrame) -> Any:
    figure, axes = sheet(1, 2, ["Times of full laps", "As the training went"], (5.0, 3.0))
    seconds, episode = values(data, "seconds", "unique_episode")
    histogram(axes[0], seconds, min(30, 5 + data.height // 4))
    name_axes(axes[0], "s", "laps")
    axes[1].scatter(episode, seconds, s=8, color=BLUE, lw=0)
    name_axes(axes[1], "episode", "s")
    return figure


def _draw_correlations(data: pl.DataFrame, laps: pl.DataFrame) -> Any:
    causes = data.drop_nulls("correlation").head(6)
    called = {name: CALLED.get(name, name) for name in causes["feature"]}
    correlations = zip(called.values(), causes["correlation"], strict=True)
    figure, axes = sheet(2, 3, [f"{words.split(' (')[0].capitalize()}: {value:+.2f}" for words, value in correlations])
    for one, (name, words) in zip(axes, called.items(), strict=True):
        value, seconds = values(few(laps), name, "seconds")
        one.scatter(np.degrees(value) if name.endswith("_rad") else value, seconds, s=9, color=BLUE, alpha=0.6, lw=0)
        name_axes(one, words, "lap (s)")
    return figure


def _draw_sectors(data: pl.DataFrame, names: list[str]) -> Any:
    figure, (axes,) = sheet(
        1, 1, ["Sector times of full laps: best, half of them, all"], (8.0, 1.0 + 0.34 * len(names))
    )
    groups = [values(data.filter(data["sector"] == name), "seconds")[0] for name in names]
    axes.boxplot(groups, orientation="horizontal", widths=0.6, showfliers=False, patch_artist=True,
                 boxprops={"fc": "#cfe3f1", "ec": BLUE}, medianprops={"color": ORANGE, "lw": 2})  # fmt: skip
    axes.scatter([group.min() for group in groups], np.arange(1, len(groups) + 1), color=GREEN, marker="d", zorder=3)
    axes.set_yticks(np.arange(1, len(names) + 1), names, fontsize=9)
    axes.invert_yaxis()
    name_axes(axes, "s", "")
    return figure
