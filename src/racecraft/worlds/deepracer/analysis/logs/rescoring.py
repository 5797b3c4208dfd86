"""Another reward for laps that were driven: what would it have paid? Begin with `new_reward`.

The reward function gets the dictionary that the simulator would have given it (`driving/reward/rescore.py`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, sheet
from racecraft.worlds.deepracer.analysis.logs.plot import name_axes, require, values
from racecraft.worlds.deepracer.driving.reward.rescore import Rescored, rows_of
from racecraft.worlds.deepracer.env.reward_params import RewardParams
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

Params = dict[str, Any]
COLOUR, QUIET_COLOUR = "#0072b2", "#7a8087"


def reward_params(ticks: pl.DataFrame | pl.LazyFrame, track: Track) -> Iterator[Params]:
    """Yield the dictionary of each tick as the simulator hands it to a reward function: degrees, percent, metres."""
    rows, _ = rows_of(_required(ticks), track)
    yield from RewardParams(track, track.is_reversed).of(rows)


def new_reward(ticks: pl.DataFrame | pl.LazyFrame, track: Track, reward_function: Callable[[Params], Any]) -> Plot:
    """Return what another reward function pays for the laps that were driven: the ticks with `new_reward`.

    The tick in which the car is held is paid nothing, as in the simulator. The figure sets both rewards of each episode
    side by side; where dots lie on no rising line, the two rewards want different things.

    Args:
        ticks: The ticks.
        track: The circuit, turned as it was driven.
        reward_function: Takes the dictionary of `reward_params`; `env.reward_process` opens one from a file.
    """
    import polars as pl

    frame = _required(ticks)
    rows, has_reward = rows_of(frame, track)
    paid = np.zeros(len(rows))
    paid[has_reward] = [
        float(reward_function(params)) for params in RewardParams(track, track.is_reversed).of(rows[has_reward])
    ]
    data = frame.with_columns(pl.Series("new_reward", paid, dtype=pl.Float64))
    return Plot("new_reward", "Another reward for the same laps", data, lambda: _draw(data))


def scatter_of_rewards(found: Rescored) -> Plot:
    """Return both rewards of each episode, and of each complete lap its time with both."""
    import polars as pl

    data = pl.DataFrame([one.__dict__ for one in found.episodes])
    return Plot("rescored", "Then and now", data, lambda: _draw_rescored(found))


def _required(ticks: pl.DataFrame | pl.LazyFrame) -> pl.DataFrame:
    return require(ticks, "x_m", "y_m", "yaw_rad", "steering_rad", "speed_mps", "tick", "progress_share", "status",
                   "all_wheels_on_track", "reward", "unique_episode")  # fmt: skip


def _draw(data: pl.DataFrame) -> Any:
    import polars as pl

    sums = data.group_by("unique_episode").agg(pl.col("reward", "new_reward").sum())
    figure, (axes,) = sheet(1, 1, ["Reward of each episode, then and now"], (5.0, 3.6))
    axes.scatter(*values(sums, "reward", "new_reward"), s=10, color=COLOUR, alpha=0.6, lw=0)
    name_axes(axes, "reward in the log", "new reward")
    return figure


def _draw_rescored(found: Rescored) -> Any:
    titles = ["Reward of each episode", "Complete laps, then", "Complete laps, now"]
    figure, (episodes, *laps) = sheet(1, 3, titles if found.laps else titles[:1], (4.2, 3.6))
    for is_lap, colour in ((False, QUIET_COLOUR), (True, COLOUR)):
        some = [one for one in found.episodes if one.is_lap is is_lap]
        label = "complete laps" if is_lap else "others"
        episodes.scatter([e.old for e in some], [e.new for e in some], s=12, color=colour, alpha=0.6, lw=0, label=label)
    episodes.legend(frameon=False, fontsize=8)
    name_axes(episodes, "reward in the log", "new reward")
    for axes, name in zip(laps, ("old", "new"), strict=False):
        axes.scatter(
            [one.seconds for one in found.laps], [getattr(one, name) for one in found.laps], s=12, color=COLOUR
        )
        name_axes(axes, "lap time (s)", "reward in the log" if name == "old" else "new reward")
    return figure
