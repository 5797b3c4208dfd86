"""Another reward for laps that were driven: what would it have paid? Begin with `new_reward`.

The reward function gets the dictionary that the simulator would have given it, in AWS's words and units, with every
place computed from x and y on the track.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, sheet
from racecraft.worlds.deepracer.analysis.logs.plot import name_axes, require, values
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl

Params = dict[str, Any]


def reward_params(ticks: pl.DataFrame | pl.LazyFrame, track: Track) -> Iterator[Params]:
    """Yield the dictionary of each tick as the simulator hands it to a reward function: degrees, percent, metres."""
    frame = require(ticks, "x_m", "y_m", "yaw_rad", "steering_rad", "speed_mps", "tick", "progress_share", "status",
                    "all_wheels_on_track")  # fmt: skip
    found = track.locate(frame.select("x_m", "y_m").to_numpy())
    waypoints = [tuple(row) for row in track.centre.tolist()]
    degrees = {name: np.degrees(values(frame, name)[0]) for name in ("yaw_rad", "steering_rad")}
    status = frame["status"].cast(str).to_list()
    columns = zip(
        frame["x_m"].to_list(), frame["y_m"].to_list(), degrees["yaw_rad"].tolist(), degrees["steering_rad"].tolist(),
        frame["speed_mps"].to_list(), frame["tick"].to_list(), (100 * values(frame, "progress_share")[0]).tolist(),
        frame["all_wheels_on_track"].to_list(), status, found.distance.tolist(), found.is_left.tolist(),
        found.width.tolist(), found.previous_waypoint.tolist(), found.next_waypoint.tolist(), found.arc.tolist(),
        strict=True,
    )  # fmt: skip
    for x, y, yaw, steer, speed, tick, progress, wheels, state, off, left, width, before, after, arc in columns:
        yield {
            "all_wheels_on_track": bool(wheels), "x": x, "y": y, "closest_waypoints": [before, after],
            "distance_from_center": off, "heading": yaw, "is_left_of_center": left, "is_offtrack": state == "off_track",
            "is_crashed": state == "crashed", "is_reversed": not track.is_ccw, "progress": progress, "speed": speed,
            "steering_angle": steer, "steps": tick, "track_length": track.length, "track_width": width,
            "waypoints": waypoints, "projection_distance": arc, "closest_objects": [0, 0], "objects_distance": [],
            "objects_heading": [], "objects_left_of_center": [], "objects_location": [], "objects_speed": [],
        }  # fmt: skip


def new_reward(ticks: pl.DataFrame | pl.LazyFrame, track: Track, reward_function: Callable[[Params], Any]) -> Plot:
    """Return what another reward function pays for the laps that were driven: the ticks with `new_reward`.

    The tick in which the car is held is paid nothing, as in the simulator. The figure sets both rewards of each episode
    side by side; where dots lie on no rising line, the two rewards want different things.

    Args:
        ticks: The ticks.
        track: The circuit, turned as it was driven.
        reward_function: Takes the dictionary of `reward_params`; `formats.aws.reward_file` loads one from a file.
    """
    import polars as pl

    frame = require(ticks, "status", "reward", "unique_episode")
    held = (frame["status"] == "prepare").fill_null(False).to_list()
    paid = [
        0.0 if waits else float(reward_function(params))
        for waits, params in zip(held, reward_params(frame, track), strict=True)
    ]
    data = frame.with_columns(pl.Series("new_reward", paid, dtype=pl.Float64))
    return Plot("new_reward", "Another reward for the same laps", data, lambda: _draw(data))


def _draw(data: pl.DataFrame) -> Any:
    import polars as pl

    sums = data.group_by("unique_episode").agg(pl.col("reward", "new_reward").sum())
    figure, (axes,) = sheet(1, 1, ["Reward of each episode, then and now"], (5.0, 3.6))
    axes.scatter(*values(sums, "reward", "new_reward"), s=10, color="#0072b2", alpha=0.6, lw=0)
    name_axes(axes, "reward in the log", "new reward")
    return figure
