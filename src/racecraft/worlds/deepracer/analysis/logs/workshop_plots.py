"""The plots of `log_analysis.py` of 2018 and 2019 under their names.

Plots take today's ticks (`logs.old_names.ticks_of` makes them of an old table) and return a `Plot`, which a notebook
shows as the last value of a cell; `print_border` and `plot_grid_world` draw as they did.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, PlotError
from racecraft.contract.world import Array
from racecraft.pages.colours import INK
from racecraft.worlds.deepracer.analysis.logs import actions, episodes, heat, paths, progress
from racecraft.worlds.deepracer.analysis.logs.plot import QUIET
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

CM = 100.0


def print_border(ax: Any, waypoints: Any, inner_border_waypoints: Any, outer_border_waypoints: Any) -> None:
    """Draw the centre line and both borders, (K, 2) each, on axes."""
    for line, style in ((waypoints, "--"), (inner_border_waypoints, "-"), (outer_border_waypoints, "-")):
        points = np.asarray(line, float)[:, :2]
        ax.plot(*points.T, color=QUIET, lw=1.0, ls=style)
    ax.set_aspect("equal")


def plot_coords(ax: Any, ob: Any) -> None:
    """Draw the points of a line on axes; what has `.xy`, as shapely's lines have, or (K, 2)."""
    ax.plot(*_xy(ob), ".", color=QUIET, zorder=1)


def plot_line(ax: Any, ob: Any) -> None:
    """Draw a line on axes, likewise."""
    ax.plot(*_xy(ob), color=INK, alpha=0.7, lw=3, solid_capstyle="round", zorder=2)


def make_error_boxes(
    ax: Any, xdata: Any, ydata: Any, xerror: Any, yerror: Any, facecolor: str = "r", edgecolor: str = "r",
    alpha: float = 0.3,
) -> int:  # fmt: skip
    """Draw a box round each of K points, so far to the left and right, down and up as (2, K) errors say; return 0."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Rectangle

    corners = zip(xdata, ydata, np.asarray(xerror).T, np.asarray(yerror).T, strict=True)
    boxes = [Rectangle((x - across[0], y - up[0]), across.sum(), up.sum()) for x, y, across, up in corners]
    ax.add_collection(PatchCollection(boxes, facecolor=facecolor, edgecolor=edgecolor, alpha=alpha))
    return 0


def _xy(line: Any) -> tuple[Array, Array]:
    x, y = line.xy if hasattr(line, "xy") else np.asarray(line, float)[:, :2].T
    return np.asarray(x), np.asarray(y)


def plot_track(ticks: pl.DataFrame, track: Track, value: str = "reward") -> Plot:
    """Return where how much was earned: `reward_heat_map`, every tick in its cell."""
    return heat.reward_heat_map(ticks, track, value)


def plot_top_laps(ticks: pl.DataFrame, track: Track, n_plot: int = 5) -> Plot:
    """Return the episodes of the largest reward, their paths: `selected_laps`."""
    best = episodes.simulation_agg(ticks).sort("reward", descending=True).head(n_plot)["unique_episode"].to_list()
    return paths.selected_laps(ticks, track, best)


def plot_episode_run(ticks: pl.DataFrame, track: Track, episode: int) -> Plot:
    """Return one episode's path, by its number in the log: `one_episode`.

    Raises:
        PlotError: There is no such episode.
    """
    import polars as pl

    mine = ticks.filter(pl.col("episode") == episode)["unique_episode"]
    if not len(mine):
        raise PlotError(
            "There is no episode {episode}; expected one of {n_unique} in the log.",
            episode=episode,
            n_unique=ticks["episode"].n_unique(),
        )
    return paths.one_episode(ticks, track, int(mine[0]))


def analyze_training_progress(ticks: pl.DataFrame) -> Plot:
    """Return reward and progress over the iterations: `training_progress`."""
    return progress.training_progress(ticks)


def action_breakdown(ticks: pl.DataFrame, track: Track) -> Plot:
    """Return the actions of each segment, which every track has: `action_breakdown`."""
    return actions.action_breakdown(ticks, track)


def plot_grid_world(
    episode_df: Any,
    inner: Any,
    outer: Any,
    scale: float = 10.0,
    plot: bool = True,
    on_message: Callable[[str], None] = print,
) -> tuple[float, float, list[tuple[float, ...]]]:
    """Tell one lap, and draw its mean throttle in squares over the road.

    Args:
        episode_df: One episode of `convert_to_pandas`: cm, simulated seconds.
        inner: Inner border, (K, 2) cm.
        outer: Outer border, likewise.
        scale: Side of a square, cm.
        plot: Whether it is drawn, into a figure of `pyplot`'s, as it always was.
        on_message: Called with each line.

    Returns:
        (lap time in s, mean throttle, [(distance in m, lap time, mean velocity, mean, least and largest throttle)]).

    Raises:
        PlotError: The episode has less than two ticks.
    """
    x, y, throttle, time = (np.asarray(episode_df[name], float) for name in ("x", "y", "throttle", "timestamp"))
    if len(x) < 2:
        raise PlotError("The episode has {count} tick(s); expected two at least. Choose another.", count=len(x))
    distance = float(np.hypot(np.diff(x), np.diff(y)).sum()) / CM
    seconds = float(time[-1] - time[0])
    velocity = distance / seconds if seconds > 0 else math.nan
    mean = float(np.nanmean(throttle))
    on_message(f"Distance, lap time = {distance:.2f} (meters), {seconds:.2f} (sec)")
    on_message(f"Average throttle, velocity = {mean:.2f} (Gazebo), {velocity:.2f} (meters/sec)")
    if plot:
        grid = grid_of(x, y, throttle, np.asarray(inner, float), np.asarray(outer, float), scale)
        _draw_grid(grid, f"Lap time (sec) = {seconds:.2f}")
    return seconds, mean, [(distance, seconds, velocity, mean, float(throttle.min()), float(throttle.max()))]


def grid_of(x: Array, y: Array, value: Array, inner: Array, outer: Array, scale: float) -> Array:
    """Return the mean of a value (T,) in each square, (rows of y, columns of x); -1 on the road, NaN beside it."""
    from matplotlib.path import Path

    across, up = (int(np.ceil(outer[:, k].max() / scale)) + 1 for k in (0, 1))
    middles = scale * (np.stack(np.meshgrid(np.arange(across), np.arange(up)), axis=-1).reshape(-1, 2) + 0.5)
    on_road = Path(outer[:, :2]).contains_points(middles) & ~Path(inner[:, :2]).contains_points(middles)
    grid = np.where(on_road, -1.0, np.nan)
    squares = np.clip((y // scale).astype(int), 0, up - 1) * across + np.clip((x // scale).astype(int), 0, across - 1)
    counts = np.bincount(squares, minlength=len(grid))
    sums = np.bincount(squares, weights=value, minlength=len(grid))
    there = counts > 0
    grid[there] = sums[there] / counts[there]
    return grid.reshape(up, across)


def _draw_grid(grid: Array, title: str) -> None:
    """Draw where a notebook that uses `pyplot` will find it."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6, 6))
    figure.colorbar(axes.imshow(grid, origin="lower", cmap="cividis"), ax=axes)
    axes.set_title(title)


def plot_trackpoints(track: Track) -> Plot:
    """Return the waypoints of a track with their numbers."""
    import polars as pl

    from racecraft.worlds.deepracer.tracks.picture import draw_track

    names = ("centre_x_m", "centre_y_m", "inner_x_m", "inner_y_m", "outer_x_m", "outer_y_m")
    data = pl.DataFrame(np.hstack([track.centre, track.inner, track.outer]), schema=list(names))
    return Plot("trackpoints", track.title or track.name, data, lambda: draw_track(track))
