"""What the car chose, where, and how often. Begin with `action_table` and `action_breakdown`.

Discrete actions go by the number, angle and speed that stand in the log itself. Continuous ones are put into even bins
of steering and speed, so that every plot works for both.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, sheet
from racecraft.contract.world import Array
from racecraft.pages.colours import BLUE, CYCLE, GREEN, INK
from racecraft.worlds.deepracer.analysis.logs.plot import QUIET, few, map_sheet, name_axes, require, values
from racecraft.worlds.deepracer.analysis.logs.segments import find_segments, in_segments
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

STEERING_BINS, SPEED_BINS = 7, 3
CONTINUOUS = -1


def with_action_number(ticks: pl.DataFrame | pl.LazyFrame) -> pl.DataFrame:
    """Add `action_number`, leaving out ticks in which the car is held.

    It is the action's own number; where actions are continuous, that of one of STEERING_BINS x SPEED_BINS even bins of
    what was commanded, right to left, slow to fast.
    """
    import polars as pl

    frame = require(ticks, "action", "steering_rad", "speed_mps", "status")
    frame = frame.filter((pl.col("status") != "prepare").fill_null(True))
    require(frame)
    if not (frame["action"] == CONTINUOUS).any():
        return frame.with_columns(pl.col("action").alias("action_number"))
    steer = _bin(frame["steering_rad"].to_numpy(), STEERING_BINS)
    speed = _bin(frame["speed_mps"].to_numpy(), SPEED_BINS)
    return frame.with_columns(pl.Series("action_number", (steer * SPEED_BINS + speed).astype(np.int32)))


def _bin(values: Any, bins: int) -> Any:
    low, high = float(np.min(values)), float(np.max(values))
    return np.clip(((values - low) / max(high - low, 1e-9) * bins).astype(int), 0, bins - 1)


def action_table(ticks: pl.DataFrame | pl.LazyFrame) -> pl.DataFrame:
    """Return the actions: `action`, `name` (of a bin its middle), `steering_rad`, `speed_mps` (means in a bin),
    `count`, `share`, `mean_reward`; by number.
    """  # noqa: D205
    import polars as pl

    frame = with_action_number(ticks)
    grouped = frame.group_by(pl.col("action_number").alias("action")).agg(
        pl.col("steering_rad").mean(), pl.col("speed_mps").mean(), pl.len().alias("count"),
        pl.col("reward").mean().alias("mean_reward"),
    )  # fmt: skip
    table = grouped.sort("action").with_columns((pl.col("count") / frame.height).alias("share"))
    if (frame["action"] == CONTINUOUS).any():
        steer, speed = _middles(frame["steering_rad"], STEERING_BINS), _middles(frame["speed_mps"], SPEED_BINS)
        words = [f"{a}: ~{_angle(steer[a // SPEED_BINS], 0)}, {speed[a % SPEED_BINS]:.2g} m/s" for a in table["action"]]
    else:
        rows = zip(table["action"], table["steering_rad"], table["speed_mps"], strict=True)
        words = [f"{a}: {_angle(radians, 1)}, {speed:.3g} m/s" for a, radians, speed in rows]
    return table.with_columns(pl.Series("name", words)).select(
        "action", "name", "steering_rad", "speed_mps", "count", "share", "mean_reward"
    )


def _middles(column: pl.Series, bins: int) -> Array:
    """Return the middles of the even bins of `_bin`."""
    low, high = float(np.min(column.to_numpy())), float(np.max(column.to_numpy()))
    return low + (np.arange(bins) + 0.5) * (high - low) / bins


def _angle(radians: float, digits: int) -> str:
    """Return an angle in words.

    >>> _angle(-0.25, 1), _angle(0.25, 0), _angle(0.002, 0)
    ('14.3° right', '14° left', 'ahead')
    """
    angle = round(abs(math.degrees(radians)), digits)
    return "ahead" if angle == 0 else f"{angle:g}° {'left' if radians > 0 else 'right'}"


def action_names(ticks: pl.DataFrame | pl.LazyFrame) -> dict[int, str]:
    """Return what each action is called: number, steering and speed as the log has them."""
    table = action_table(ticks)
    return dict(zip(table["action"].to_list(), table["name"].to_list(), strict=True))


def action_histogram(ticks: pl.DataFrame | pl.LazyFrame) -> Plot:
    """Return how often each action was chosen: `action_table`."""
    data = action_table(ticks)
    return Plot("action_histogram", "How often each action was chosen", data, lambda: _draw_histogram(data))


def action_space(ticks: pl.DataFrame | pl.LazyFrame) -> Plot:
    """Return the action space as a fan: angle is steering (left is left), radius speed, size how often it was chosen.

    Data: `action_table`; the dots of a continuous action space are the ticks themselves.
    """
    frame = with_action_number(ticks)
    data = action_table(frame)
    continuous = bool((frame["action"] == CONTINUOUS).any())
    return Plot("action_space", "Action space", data, lambda: _draw_space(data, frame if continuous else None))


def action_breakdown(ticks: pl.DataFrame | pl.LazyFrame, track: Track) -> Plot:
    """Return which actions were chosen in which segment of the circuit.

    Columns: `segment` (its name), `action`, `name`, `count`, `share` (of the segment's ticks), `mean_reward`. Segments
    are found from the curvature (see `segments.py`).
    """
    import polars as pl

    segments = find_segments(track)
    frame = in_segments(with_action_number(ticks), track, segments)
    names = action_names(frame)
    data = (
        frame.group_by("segment", pl.col("action_number").alias("action"))
        .agg(pl.len().alias("count"), pl.col("reward").mean().alias("mean_reward"))
        .with_columns((pl.col("count") / pl.col("count").sum().over("segment")).alias("share"))
        .sort("segment", "action")
        .select(
            pl.col("segment").replace_strict(segments.names, return_dtype=pl.String),
            "action", pl.col("action").replace_strict(names, return_dtype=pl.String).alias("name"),
            "count", "share", "mean_reward",
        )
    )  # fmt: skip
    order = list(segments.names.values())
    return Plot("action_breakdown", "Actions by segment", data, lambda: _draw_breakdown(data, order, names))


def action_index_map(ticks: pl.DataFrame | pl.LazyFrame, track: Track) -> Plot:
    """Return where the car steered where to: the ticks with `action_number`, coloured left, ahead and right."""
    data = with_action_number(ticks)
    return Plot("action_map", "Left, ahead and right on the circuit", data, lambda: _draw_map(few(data), track))


def _draw_histogram(data: pl.DataFrame) -> Any:
    figure, (axes,) = sheet(1, 1, ["How often each action was chosen"], (7.0, 0.9 + 0.26 * data.height))
    at = np.arange(data.height)
    axes.barh(at, 100 * values(data, "share")[0], color=BLUE, height=0.7)
    axes.set_yticks(at, data["name"].to_list(), fontsize=9)
    axes.invert_yaxis()
    name_axes(axes, "% of the ticks", "")
    return figure


def _draw_space(data: pl.DataFrame, dots: pl.DataFrame | None) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.5, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    axes: Any = figure.add_subplot(projection="polar")
    axes.set_theta_zero_location("N")
    steer, speed, share = values(data, "steering_rad", "speed_mps", "share")
    if dots is not None:
        axes.scatter(*values(few(dots, 4000), "steering_rad", "speed_mps"), s=5, color=BLUE, alpha=0.3, lw=0)
    else:
        axes.scatter(steer, speed, s=30 + 1500 * share, color=BLUE, alpha=0.65, lw=0)
        for number, angle, radius in zip(data["action"], steer, speed, strict=True):
            axes.annotate(str(number), (angle, radius), fontsize=8, ha="center", va="center")
    widest = max(0.3, float(np.abs(steer).max()) * 1.2)
    axes.set_thetamin(-math.degrees(widest))
    axes.set_thetamax(math.degrees(widest))
    axes.set_rlim(0, float(np.max(speed)) * 1.15)
    axes.xaxis.set_major_formatter(lambda radians, _: _angle(radians, 0))
    axes.tick_params(labelsize=8, colors=QUIET)
    axes.spines[:].set_color(QUIET)
    axes.grid(color=QUIET, alpha=0.3, lw=0.8)
    axes.set_axisbelow(True)
    axes.set_title("Steering and speed (m/s, outward)", loc="left", fontsize=11, color=INK)
    return figure


def _draw_breakdown(data: pl.DataFrame, order: list[str], names: dict[int, str]) -> Any:
    figure, (axes,) = sheet(1, 1, ["Share of each action, segment by segment"], (8.5, 1.2 + 0.4 * len(order)))
    left = np.zeros(len(order))
    numbers = list(names)
    shades = _shades(len(numbers))
    for k, number in enumerate(numbers):
        rows = data.filter(data["action"] == number)
        found = dict(zip(rows["segment"], rows["share"], strict=True))
        width = np.array([100 * found.get(name, 0.0) for name in order])
        axes.barh(np.arange(len(order)), width, left=left, color=shades[k], edgecolor="white", lw=0.6,
                  hatch=("", "///", "...")[k % 3], label=names[number])  # fmt: skip
        left += width
    axes.set_yticks(np.arange(len(order)), order, fontsize=9)
    axes.invert_yaxis()
    axes.set_xlim(0, 100)
    name_axes(axes, "% of the segment's ticks", "")
    axes.legend(frameon=False, fontsize=7, loc="upper left", bbox_to_anchor=(1.0, 1.0), ncols=1 + len(numbers) // 16)
    return figure


def _shades(count: int) -> Any:
    from matplotlib import colormaps

    return colormaps["cividis"](np.linspace(0.05, 1.0, max(2, count)))


def _draw_map(data: pl.DataFrame, track: Track) -> Any:
    figure, (axes,) = map_sheet(track, 1, [""])
    x, y, steer = values(data, "x_m", "y_m", "steering_rad")
    straight = np.abs(steer) < math.radians(2.0)
    sides = ((steer > 0) & ~straight, straight, (steer < 0) & ~straight)
    for chosen, word, colour, mark in zip(sides, ("left", "ahead", "right"), (BLUE, GREEN, CYCLE[1]), "<^>",
                                          strict=True):  # fmt: skip
        axes.scatter(x[chosen], y[chosen], s=7, marker=mark, color=colour, alpha=0.5, lw=0, zorder=3, label=word)
    axes.legend(frameon=False, fontsize=9, markerscale=2, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    return figure
