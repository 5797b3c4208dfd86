"""What was paid: which rewards are common, how they spread, what discounts leave. Begin with `common_rewards`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, PlotError, sheet
from racecraft.pages.colours import BLUE, CYCLE, GREEN
from racecraft.worlds.deepracer.analysis.logs.plot import name_axes, require, spread_limits, values

if TYPE_CHECKING:
    import polars as pl

DISCOUNTS = (0.9, 0.95, 0.99, 0.999)
LINES = ("-", "--", "-.", ":")


def common_rewards(ticks: pl.DataFrame | pl.LazyFrame, count: int = 20, digits: int = 4) -> Plot:
    """Return the rewards paid most often, most frequent first: `reward` (rounded), `count`, `share`, `steps`.

    `steps` is how many different steps of an episode it was paid at; a reward paid once each time hints at a bonus.
    """
    import polars as pl

    frame = _driven(ticks)
    data = (
        frame.group_by(pl.col("reward").round(digits))
        .agg(pl.len().alias("count"), pl.col("tick").n_unique().alias("steps"))
        .with_columns((pl.col("count") / frame.height).alias("share"))
        .sort("count", "reward", descending=[True, False])
        .head(count)
        .select("reward", "count", "share", "steps")
    )
    return Plot("common_rewards", "Rewards paid most often", data, lambda: _draw_common(data))


def reward_distribution(ticks: pl.DataFrame | pl.LazyFrame, bins: int = 40) -> Plot:
    """Return how the reward of a tick spreads: `low`, `high`, `count` of even bins."""
    import polars as pl

    paid = _driven(ticks)["reward"].drop_nulls().to_numpy()
    counts, edges = np.histogram(paid, bins=bins, range=spread_limits(paid))
    data = pl.DataFrame({"low": edges[:-1], "high": edges[1:], "count": counts})
    return Plot("reward_distribution", "How the reward of a tick spreads", data, lambda: _draw_spread(data))


def discount_tester(
    ticks: pl.DataFrame | pl.LazyFrame, discounts: Sequence[float] = DISCOUNTS, unique_episode: int | None = None
) -> Plot:
    """Return what the steps of an episode are worth under several discount factors.

    Args:
        ticks: The ticks.
        discounts: Factors, each above 0 and at most 1.
        unique_episode: Which episode; None: the one that came furthest, the earliest of equals.

    Returns:
        `tick`, `discount`, `reward`, `value` (the reward of this step and all later ones of the episode, discounted).

    Raises:
        PlotError: A discount is out of range, or there is no such episode.
    """
    import polars as pl

    if wrong := [one for one in discounts if not 0.0 < one <= 1.0]:
        raise PlotError("{wrong} is no discount factor; expected above 0 and at most 1.", wrong=wrong[0])
    frame = require(ticks, "unique_episode", "tick", "reward", "progress_share")
    if unique_episode is None:
        reached = frame.group_by("unique_episode").agg(pl.col("progress_share").max())
        unique_episode = int(reached.sort("progress_share", "unique_episode", descending=[True, False])[0, 0])
    one = frame.filter(pl.col("unique_episode") == unique_episode)
    require(one)
    parts = [
        one.select("tick", pl.lit(factor).alias("discount"), "reward", pl.Series("value", _returns(one, factor)))
        for factor in discounts
    ]
    data = pl.concat(parts)
    title = f"What the steps of episode {unique_episode} are worth"
    return Plot("discount_tester", title, data, lambda: _draw_discounts(data, discounts))


def _driven(ticks: pl.DataFrame | pl.LazyFrame) -> pl.DataFrame:
    import polars as pl

    frame = require(ticks, "tick", "reward", "status")
    return require(frame.filter((pl.col("status") != "prepare").fill_null(True)))


def _returns(episode: pl.DataFrame, discount: float) -> Any:
    """Return the discounted sums of what is still to come, (T,)."""
    rewards = values(episode, "reward")[0]
    worth = np.empty_like(rewards)
    later = 0.0
    for k in range(len(rewards) - 1, -1, -1):  # one episode: some hundreds of steps
        later = worth[k] = rewards[k] + discount * later
    return worth


def _draw_common(data: pl.DataFrame) -> Any:
    figure, (axes,) = sheet(1, 1, ["Rewards paid most often"], (7.0, 0.9 + 0.24 * data.height))
    at = np.arange(data.height)
    axes.barh(at, 100 * values(data, "share")[0], color=BLUE, height=0.7)
    axes.set_yticks(at, [f"{reward:g}" for reward in data["reward"]], fontsize=9)
    axes.invert_yaxis()
    name_axes(axes, "% of the ticks", "reward")
    return figure


def _draw_spread(data: pl.DataFrame) -> Any:
    figure, (axes,) = sheet(1, 1, ["How the reward of a tick spreads"], (7.0, 3.0))
    low, high, count = values(data, "low", "high", "count")
    axes.bar(low, count, width=high - low, align="edge", color=GREEN, edgecolor="white", lw=0.4)
    name_axes(axes, "reward of a tick", "ticks")
    return figure


def _draw_discounts(data: pl.DataFrame, discounts: Sequence[float]) -> Any:
    figure, (axes,) = sheet(1, 1, ["What is still to come, discounted"], (8.0, 3.2))
    for k, factor in enumerate(discounts):
        rows = data.filter(data["discount"] == factor)
        axes.plot(*values(rows, "tick", "value"), color=CYCLE[k % 6], ls=LINES[k % 4], lw=1.6, label=f"{factor:g}")
    axes.legend(frameon=False, fontsize=9, title="discount", title_fontsize=9)
    name_axes(axes, "step", "value")
    return figure
