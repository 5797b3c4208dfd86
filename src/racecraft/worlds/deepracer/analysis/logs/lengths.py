"""How much episodes earned and how long they were: the "Model CSV analysis" of the workshops' notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from racecraft.analysis.plot import Plot, PlotError, sheet
from racecraft.pages.colours import BLUE, ORANGE
from racecraft.worlds.deepracer.analysis.logs.plot import few, histogram, name_axes, require, values

if TYPE_CHECKING:
    import polars as pl


def rewards_and_lengths(episodes: pl.DataFrame | pl.LazyFrame) -> Plot:
    """Return the spread of episodes' rewards and lengths, and both as the training went.

    Args:
        episodes: One row an episode, with `episode`, `reward` and `steps`: `simulation_agg` of a log, or
            `Logs.metrics` of Coach's CSV, whose heat-up and evaluations, without one of them, are left out.

    Raises:
        PlotError: No episode tells both.
    """
    data = require(episodes.lazy().collect(), "episode", "reward", "steps").drop_nulls(["reward", "steps"])
    if not data.height:
        raise PlotError("No episode here tells its reward and its steps; expected Coach's CSV, or a log with ticks.")
    return Plot("rewards_and_lengths", "Rewards and lengths of episodes", data, lambda: _draw(data))


def _draw(data: pl.DataFrame) -> Any:
    titles = ["Rewards", "Lengths", "Rewards as it trained", "Lengths as it trained"]
    figure, axes = sheet(2, 2, titles, (5.0, 2.8))
    shown = few(data)
    for k, (name, words, colour) in enumerate((("reward", "reward", BLUE), ("steps", "steps", ORANGE))):
        histogram(axes[k], values(data, name)[0], 30)
        name_axes(axes[k], words, "episodes")
        axes[2 + k].scatter(*values(shown, "episode", name), s=6, color=colour, lw=0)
        name_axes(axes[2 + k], "episode", words)
    return figure
