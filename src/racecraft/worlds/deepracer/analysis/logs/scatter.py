"""Laps as dots: what goes with what, all at once or fifth by fifth. Begin with `scatter_of_laps` and `quintiles`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from racecraft.analysis.plot import Plot, PlotError, sheet
from racecraft.contract.world import Array
from racecraft.pages.colours import BLUE
from racecraft.worlds.deepracer.analysis.logs.episodes import QUINTILES, simulation_agg
from racecraft.worlds.deepracer.analysis.logs.plot import few, histogram, name_axes, values

if TYPE_CHECKING:
    import polars as pl

NAMES = {
    "seconds": "time (s)", "reward": "reward", "progress_share": "progress (%)", "steps": "steps",
    "start_at": "start (waypoint)", "seconds_if_complete": "time if complete (s)",
    "distance_m": "distance (m)", "speed_mps": "mean commanded speed (m/s)",
}  # fmt: skip
PAIRS = (
    ("seconds", "progress_share"), ("seconds", "steps"), ("seconds", "reward"), ("start_at", "progress_share"),
    ("start_at", "seconds_if_complete"), ("start_at", "reward"),
)  # fmt: skip
LAP_PAIRS = (
    ("seconds", "speed_mps"), ("seconds", "steps"), ("seconds", "reward"), ("start_at", "distance_m"),
    ("start_at", "seconds"), ("start_at", "reward"),
)  # fmt: skip
"""What is shown of full laps, whose progress tells nothing."""


def scatter_of_laps(ticks: pl.DataFrame | pl.LazyFrame, complete: bool = False) -> Plot:
    """Return all laps, or only the full ones, as dots: `simulation_agg`'s table.

    Raises:
        PlotError: There is none.
    """
    data = simulation_agg(ticks)
    if complete:
        data = data.filter(data["complete"])
    if not data.height:
        raise PlotError("There is no full lap here; expected one at least. Let the training go on.")
    title = "Full laps" if complete else "All laps"
    return Plot("scatter_complete" if complete else "scatter", title, data, lambda: _draw(data, complete))


def quintiles(ticks: pl.DataFrame | pl.LazyFrame) -> Plot:
    """Return the episodes fifth by fifth, first to last: means by `quintile`; the figure shows every lap."""
    import polars as pl

    episodes = simulation_agg(ticks)
    data = episodes.group_by("quintile").agg(
        pl.len().alias("episodes"), pl.col("reward", "seconds", "progress_share", "speed_mps").mean(),
        pl.col("complete").mean().alias("complete_share"),
        pl.col("seconds").filter(pl.col("complete")).min().alias("best_lap_seconds"),
    ).sort("quintile")  # fmt: skip
    return Plot("quintiles", "Fifth by fifth", data, lambda: _draw_quintiles(episodes))


def _draw(data: pl.DataFrame, complete: bool) -> Any:
    pairs, far = (LAP_PAIRS, "distance_m") if complete else (PAIRS, "progress_share")
    titles = [f"{NAMES[y].split(' (')[0].capitalize()} over {NAMES[x].split(' (')[0]}" for x, y in pairs]
    figure, axes = sheet(3, 3, [*titles, "How long", "How far", "How much reward"])
    dots = few(data)
    for one, (x, y) in zip(axes, pairs, strict=False):
        one.scatter(_axis_values(dots, x), _axis_values(dots, y), s=5, color=BLUE, alpha=0.45, lw=0)
        name_axes(one, NAMES[x], NAMES[y])
    for one, name in zip(axes[6:], ("seconds", far, "reward"), strict=True):
        histogram(one, _axis_values(data, name), 24)
        name_axes(one, NAMES[name], "laps" if complete else "episodes")
    return figure


def _axis_values(data: pl.DataFrame, name: str) -> Array:
    """Return a column as it stands on an axis: shares in percent."""
    return values(data, name)[0] * (100.0 if name == "progress_share" else 1.0)


def _draw_quintiles(episodes: pl.DataFrame) -> Any:
    import polars as pl

    titles = [words for fifth in QUINTILES for words in (f"{fifth} fifth", "", "")]
    figure, axes = sheet(5, 3, titles, (4.0, 2.0))
    farthest = float(episodes["seconds"].max() or 1.0)  # type: ignore[arg-type]
    for k, fifth in enumerate(QUINTILES):
        group = episodes.filter(pl.col("quintile") == fifth)
        left, middle, right = axes[3 * k : 3 * k + 3]
        left.scatter(*values(few(group), "seconds", "reward"), s=5, color=BLUE, alpha=0.5, lw=0)
        left.set_xlim(0, farthest * 1.03)
        histogram(middle, values(group, "seconds")[0], 20, limits=(0.0, farthest))
        histogram(right, 100 * values(group, "progress_share")[0], 20, limits=(0.0, 100.0))
        name_axes(left, "time (s)" if k == 4 else "", "reward")
        name_axes(middle, "time (s)" if k == 4 else "", "episodes")
        name_axes(right, "progress (%)" if k == 4 else "", "episodes")
    return figure
