"""The simulation trace: one CSV row a tick, as AWS writes it.

Begin with `TRACE_COLUMNS` and `write_sim_trace`; the readers are in `logs` (`logs/one_trace.py` reads one file back).

A trace is a dictionary of arrays of shape (T,), in the units of AWS: degrees, percent, and steps that count in
floats. `trace_from_episodes` and `episodes_from_trace` cross over to our own tables in radians and shares.

Source: facts: simapp `metrics/constants.py` (order), real traces of 2022 and 2026 (how values are printed).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.contract.errors import ContractError
from racecraft.contract.world import Array
from racecraft.formats.atomic import write_atomic

if TYPE_CHECKING:
    import polars as pl

CONTINUOUS_ACTION = -1
"""Stands in the column `action` where the action is no number but an angle and a speed."""


@dataclass(frozen=True)
class TraceColumn:
    """One column of the trace."""

    name: str
    dtype: str
    unit: str
    doc: str
    required: bool = True


TRACE_COLUMNS = (
    TraceColumn("episode", "int64", "", "Episode, counted from 0 without gaps over all iterations of a worker."),
    TraceColumn("steps", "float64", "", "Tick within the episode, counted from 1.0."),
    TraceColumn("X", "float64", "m", "Position, east."),
    TraceColumn("Y", "float64", "m", "Position, north."),
    TraceColumn("yaw", "float64", "deg", "Heading, counter-clockwise from east, -180 to 180."),
    TraceColumn("steer", "float64", "deg", "Commanded front-wheel angle, positive left."),
    TraceColumn("throttle", "float64", "m/s", "Commanded speed."),
    TraceColumn("action", "int64", "", "Number of the action; -1 for a continuous one, printed as [steer throttle]."),
    TraceColumn("reward", "float64", "", "Reward of the tick."),
    TraceColumn("done", "bool", "", "True in the episode's last row."),
    TraceColumn("all_wheels_on_track", "bool", "", "Whether all four wheels are inside the borders."),
    TraceColumn("progress", "float64", "%", "Share of the lap covered; a finished lap is printed as 100."),
    TraceColumn("closest_waypoint", "int64", "", "Index of the nearest waypoint."),
    TraceColumn("track_len", "float64", "m", "Length of the centre line."),
    TraceColumn("tstamp", "float64", "s", "Simulated time."),
    TraceColumn("episode_status", "str", "", "prepare, in_progress, lap_complete, off_track, ...", required=False),
    TraceColumn("pause_duration", "float64", "s", "Pause after a penalty.", required=False),
    TraceColumn("obstacle_crash_counter", "int64", "", "Obstacles hit so far.", required=False),
    TraceColumn("wall_clock", "float64", "s", "Time of day, since 1970 (UTC).", required=False),
)
NAMES = tuple(column.name for column in TRACE_COLUMNS)
_BY_NAME = {column.name: column for column in TRACE_COLUMNS}


@dataclass(frozen=True)
class SimTrace:
    """A trace that was read."""

    columns: dict[str, Array]
    """Arrays of shape (T,) by AWS's names; only those that the file has."""
    damaged: tuple[str, ...] = field(default=())
    """A clause for each row that was passed over: file, line and why; the first twenty."""

    def __len__(self) -> int:
        return len(self.columns["episode"])

    @property
    def continuous(self) -> bool:
        """Whether the actions are angles and speeds."""
        return bool((self.columns["action"] == CONTINUOUS_ACTION).any())


def write_sim_trace(path: str | Path, columns: Mapping[str, Array]) -> None:
    """Write a trace with AWS's own order and print.

    Args:
        path: Where to, e.g. `training-simtrace/0-iteration.csv`.
        columns: Arrays of shape (T,) by AWS's names; the required ones must be there.

    Raises:
        ContractError: A required column is missing.
        OutputFileError: The file cannot be written.
    """
    write_atomic(path, sim_trace_text(columns))


def sim_trace_text(columns: Mapping[str, Array]) -> str:
    """Return a trace as the text of its CSV file.

    Raises:
        ContractError: A required column is missing.
    """
    missing = [column.name for column in TRACE_COLUMNS if column.required and column.name not in columns]
    if missing:
        raise ContractError("A simulation trace needs the columns {missing}.", missing=", ".join(missing))
    import polars as pl

    frame = pl.DataFrame([_printed(name, columns) for name in NAMES if name in columns])
    return frame.write_csv(quote_style="never")


def trace_from_episodes(episodes: Mapping[str, Array]) -> dict[str, Array]:
    """Return the trace of a table of episodes (see `episodes.py`), of shape (T,) as well.

    Commanded angles and speeds that stand a hair beside a round number are that number, so that an action of 30
    degrees or 0.6 m/s is printed as such although it was kept in radians, and in single precision perhaps.
    """
    ticks = len(episodes["episode"])
    zeros = np.zeros(ticks)
    trace = {
        "episode": episodes["episode"],
        "steps": episodes["tick"],
        "X": episodes["x_m"],
        "Y": episodes["y_m"],
        "yaw": np.degrees(episodes["yaw_rad"]),
        "steer": _commanded(np.degrees(np.asarray(episodes["steering_rad"], np.float64))),
        "throttle": _commanded(np.asarray(episodes["speed_mps"], np.float64)),
        "action": episodes["action"],
        "reward": episodes["reward"],
        "done": episodes["done"],
        "all_wheels_on_track": episodes["all_wheels_on_track"],
        "progress": np.asarray(episodes["progress_share"], np.float64) * 100,
        "closest_waypoint": episodes["closest_waypoint"],
        "track_len": episodes["track_length_m"],
        "tstamp": episodes["time_s"],
        "episode_status": episodes["status"],
        "pause_duration": episodes.get("pause_s", zeros),
        "obstacle_crash_counter": episodes.get("obstacle_crashes", zeros),
        "wall_clock": episodes.get("wall_clock_s", zeros),
    }
    return {name: _typed(_BY_NAME[name], values) for name, values in trace.items()}


def episodes_from_trace(trace: Mapping[str, Array], iteration: int = 0, world: int = 0) -> dict[str, Array]:
    """Return the table of episodes of a trace; columns that a trace cannot know are left out."""
    ticks = len(trace["episode"])
    episodes = {
        "episode": trace["episode"],
        "world": np.full(ticks, world),
        "iteration": np.full(ticks, iteration),
        "tick": trace["steps"].astype(np.int64),
        "time_s": trace["tstamp"],
        "x_m": trace["X"],
        "y_m": trace["Y"],
        "yaw_rad": np.radians(trace["yaw"]),
        "steering_rad": np.radians(trace["steer"]),
        "speed_mps": trace["throttle"],
        "action": trace["action"],
        "reward": trace["reward"],
        "done": trace["done"],
        "all_wheels_on_track": trace["all_wheels_on_track"],
        "progress_share": trace["progress"] / 100,
        "closest_waypoint": trace["closest_waypoint"],
        "track_length_m": trace["track_len"],
    }
    others = {
        "episode_status": "status",
        "pause_duration": "pause_s",
        "obstacle_crash_counter": "obstacle_crashes",
        "wall_clock": "wall_clock_s",
    }
    return {**episodes, **{ours: trace[theirs] for theirs, ours in others.items() if theirs in trace}}


def _printed(name: str, columns: Mapping[str, Array]) -> pl.Series:
    """Return a column's values as they shall stand in the file."""
    import polars as pl

    values = _typed(_BY_NAME[name], columns[name])
    if name == "action" and (values == CONTINUOUS_ACTION).any():
        return pl.Series(name, action_texts(columns))
    if name == "progress":
        whole = pl.Series(values == 100)
        return pl.Series(name, ["100"]).extend_constant("100", len(values) - 1).zip_with(whole, number_texts(values))
    if values.dtype == bool:
        return flag_texts(values).alias(name)
    if values.dtype.kind == "f":
        return pl.Series(name, _tellable(values))
    return pl.Series(name, values.tolist() if values.dtype.kind == "U" else values)


def number_texts(values: Array) -> pl.Series:
    """Return floats as Python prints them."""
    import polars as pl

    return pl.Series(_tellable(values)).cast(pl.String)


def _tellable(values: Array) -> Array | list[str]:
    """Return floats such that Polars prints them as Python does: as text where very small or large ones are among them.

    Polars prints five times faster, and differs only in where it begins to write exponents, and how.
    """
    sizes = np.abs(values)
    odd = (sizes < 1e-4) & (sizes > 0) | ~(sizes < 1e16)
    return list(map(repr, values.tolist())) if odd.any() else values


def flag_texts(values: Array) -> pl.Series:
    """Return booleans as Python prints them."""
    import polars as pl

    return pl.Series(["False", "True"]).gather(values.astype(np.uint32))


def action_texts(columns: Mapping[str, Array]) -> list[str]:
    """Return the actions as AWS prints them: a number, or for continuous ones "[steer speed]" without a comma."""
    values, steer, speed = (np.asarray(columns[name]).tolist() for name in ("action", "steer", "throttle"))
    return [
        f"[{float(angle)} {float(mps)}]" if value == CONTINUOUS_ACTION else str(value)
        for value, angle, mps in zip(values, steer, speed, strict=True)
    ]


def _commanded(values: Array) -> Array:
    round_values = values.round(4) + 0.0
    return np.where(np.abs(values - round_values) < 4e-6, round_values, values)


def _typed(column: TraceColumn, values: Any) -> Array:
    return np.asarray(values).astype(str if column.dtype == "str" else column.dtype, copy=False)
