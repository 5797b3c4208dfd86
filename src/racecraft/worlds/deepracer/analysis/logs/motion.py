"""How fast the car really drove, and how far it slid. Begin with `with_motion` and `slides`.

A log has the commanded speed only. The driven one is the way between two ticks over the time between them; the slide is
the angle from where the car points to where it goes, left positive.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, sheet
from racecraft.pages.colours import BLUE, ORANGE
from racecraft.worlds.deepracer.analysis.logs.circuit import on_track
from racecraft.worlds.deepracer.analysis.logs.episodes import simulation_agg
from racecraft.worlds.deepracer.analysis.logs.plot import (
    colour_bar,
    few,
    map_sheet,
    name_axes,
    require,
    values,
    was_set_down,
)
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

SLOWEST_MPS = 0.3
"""Below it the direction of travel is noise, and there is no slide."""
SETTLED = 3
"""Up to this tick of an episode the simulator may still be putting the car down, backwards too: there is no slide."""


def with_motion(ticks: pl.DataFrame | pl.LazyFrame) -> pl.DataFrame:
    """Add `driven_mps` and `slide_rad` to the ticks.

    Both are null in an episode's first tick and where the car was not driven but set down elsewhere (see `SET_BACK`);
    the slide also in the first SETTLED ticks and where the car hardly moves.
    """
    import polars as pl

    frame = require(ticks, "unique_episode", "tick", "x_m", "y_m", "yaw_rad", "time_s")
    same = pl.col("unique_episode") == pl.col("unique_episode").shift()
    dx, dy, dt = (pl.col(name) - pl.col(name).shift() for name in ("x_m", "y_m", "time_s"))
    step = pl.when(same).then((dx**2 + dy**2).sqrt())
    frame = frame.with_columns(step.alias("_step"), pl.arctan2(dy, dx).alias("_course"))
    driven = (dt > 0) & ~pl.lit(was_set_down(frame["unique_episode"], frame["_step"]))
    frame = frame.with_columns(pl.when(driven).then(pl.col("_step") / dt).alias("driven_mps"))
    turn = pl.col("_course") - (pl.col("yaw_rad") + pl.col("yaw_rad").shift()) / 2
    between = (pl.col("yaw_rad") - pl.col("yaw_rad").shift()).abs() > math.pi  # the mean of 179° and -179° is no angle
    turn = pl.when(between).then(pl.col("_course") - pl.col("yaw_rad")).otherwise(turn)
    wrapped = (turn + math.pi) % (2 * math.pi) - math.pi
    moving = (pl.col("driven_mps") > SLOWEST_MPS) & (pl.col("tick") > SETTLED)
    return frame.with_columns(pl.when(moving).then(wrapped).alias("slide_rad")).drop("_course", "_step")


def slides(ticks: pl.DataFrame | pl.LazyFrame, track: Track) -> Plot:
    """Return how the car slides: the ticks with `driven_mps`, `slide_rad` and their place on the circuit."""
    data = on_track(with_motion(ticks), track).drop_nulls("slide_rad")
    return Plot("slides", "Slides", require(data), lambda: _draw_slides(few(data), track))


def episode_distributions(ticks: pl.DataFrame | pl.LazyFrame, unique_episode: int) -> Plot:
    """Return speed, slide, reward and steering of one episode: its ticks with `driven_mps` and `slide_rad`."""
    import polars as pl

    data = with_motion(ticks).filter(pl.col("unique_episode") == unique_episode)
    return Plot(
        "episode_distributions", f"Episode {unique_episode}, step by step", require(data), lambda: _draw_episode(data)
    )


def best_episode_distributions(ticks: pl.DataFrame | pl.LazyFrame) -> Plot:
    """Return `episode_distributions` of the fastest full lap, or else of the episode that came farthest."""
    episodes = simulation_agg(ticks)
    full = episodes.filter(episodes["complete"])
    best = full.sort("seconds") if full.height else episodes.sort("progress_share", descending=True)
    return episode_distributions(ticks, int(best["unique_episode"][0]))


def _draw_slides(data: pl.DataFrame, track: Track) -> Any:
    figure, (axes,) = map_sheet(track, 1, [""])
    x, y, slide = values(data, "x_m", "y_m", "slide_rad")
    degrees = np.abs(np.degrees(slide))
    most = max(5.0, float(np.percentile(degrees, 99)))
    painted = axes.scatter(x, y, c=degrees, s=6, lw=0, cmap="cividis", vmin=0, vmax=most, zorder=3)
    colour_bar(figure, painted, axes, "slide (°, either side)")
    return figure


def _draw_episode(data: pl.DataFrame) -> Any:
    figure, axes = sheet(2, 2, ["Speed", "Slide", "Reward of a step", "Steering"], (5.0, 2.5))
    at = values(data, "tick")[0]
    driven, commanded, slide, reward, steer = values(
        data, "driven_mps", "speed_mps", "slide_rad", "reward", "steering_rad"
    )
    axes[0].step(at, commanded, color=ORANGE, lw=1.0, where="post", ls="--", label="commanded")
    axes[0].plot(at, driven, color=BLUE, lw=1.5, label="driven")
    axes[0].legend(frameon=False, fontsize=8)
    axes[1].plot(at, np.degrees(slide), color=BLUE, lw=1.2)
    axes[2].plot(at, reward, color=BLUE, lw=1.2)
    axes[3].step(at, np.degrees(steer), color=BLUE, lw=1.0, where="post")
    for one, unit in zip(axes, ("m/s", "° (left positive)", "", "° (left positive)"), strict=True):
        name_axes(one, "step", unit)
    return figure
