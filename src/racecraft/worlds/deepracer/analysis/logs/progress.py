"""How a training went: the nine charts of the training notebook. Begin with `training_progress`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, sheet
from racecraft.pages.colours import BLUE, GREEN, ORANGE
from racecraft.worlds.deepracer.analysis.logs.episodes import per_iteration, simulation_agg
from racecraft.worlds.deepracer.analysis.logs.plot import few, name_axes, nothing, values

if TYPE_CHECKING:
    import polars as pl

PANELS = (
    ("Mean reward", "reward", ""), ("Mean time", "seconds", "s"), ("Mean progress", "progress_share", "% of a lap"),
    ("Spread of the reward", "reward_std", ""), ("Spread of the time", "seconds_std", "s"),
    ("Spread of the progress", "progress_share_std", "% of a lap"),
)  # fmt: skip


def training_progress(ticks: pl.DataFrame | pl.LazyFrame) -> Plot:
    """Return how reward, time and progress went over the iterations: `per_iteration`'s table, rounds one after another.

    The last three charts show the reward of every episode, the time of full laps, and the share of full laps.
    """
    episodes = simulation_agg(ticks)
    data = per_iteration(episodes)
    return Plot("training_progress", "Training progress", data, lambda: _draw(data, episodes))


def _draw(data: pl.DataFrame, episodes: pl.DataFrame) -> Any:
    titles = [title for title, _, _ in PANELS] + ["Reward of each episode", "Time of full laps", "Share of full laps"]
    figure, axes = sheet(3, 3, titles)
    (at,) = values(data, "master_iteration")
    for one, (_, column, unit) in zip(axes, PANELS, strict=False):
        (value,) = values(data, column)
        one.plot(at, value * (100 if "progress" in column else 1), color=BLUE, lw=1.6, marker="o", ms=2.5)
        name_axes(one, "iteration", unit)
    dots = few(episodes)
    axes[6].scatter(*values(dots, "unique_episode", "reward"), s=4, color=BLUE, alpha=0.5, lw=0)
    name_axes(axes[6], "episode", "")
    mean, best = values(data, "lap_seconds", "best_lap_seconds")
    axes[7].plot(at, mean, color=ORANGE, lw=1.4, marker="o", ms=2.5, label="mean")
    axes[7].plot(at, best, color=GREEN, lw=1.4, ls="--", marker="^", ms=3, label="best")
    if np.isfinite(mean).any():
        axes[7].legend(frameon=False, fontsize=9)
    else:
        nothing(axes[7], "no full lap yet")
    name_axes(axes[7], "iteration", "s")
    axes[8].plot(at, 100 * values(data, "complete_share")[0], color=GREEN, lw=1.6, marker="o", ms=2.5)
    axes[8].set_ylim(-2, 102)
    name_axes(axes[8], "iteration", "% of the episodes")
    return figure
