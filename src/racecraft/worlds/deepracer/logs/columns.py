"""The columns of the two tables that logs are read into: one row a tick, one row an episode of a metrics file.

One table of columns feeds the reader, the checks and the documentation. Names, units and signs are those of our own
episode files (`formats/episodes.py`): SI units, radians, shares; in front stands where a row comes from.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from racecraft.formats.episodes import EPISODE_COLUMNS, STATUSES, Column

if TYPE_CHECKING:
    import polars as pl

PHASES = ("training", "evaluation", "leaderboard")
"""What a log tells of: a training, an evaluation, a submission to a leaderboard."""

_EPISODE = {column.name: column for column in EPISODE_COLUMNS}
_TICK_NAMES = (
    "tick", "time_s", "x_m", "y_m", "yaw_rad", "steering_rad", "speed_mps", "action", "reward", "done", "status",
    "all_wheels_on_track", "progress_share", "closest_waypoint", "track_length_m", "pause_s", "obstacle_crashes",
    "wall_clock_s",
)  # fmt: skip

TICK_COLUMNS: tuple[Column, ...] = (
    Column("round", "int32", "", "Which of several trainings, in the order given, counted from 1.", required=True),
    Column("phase", "str", "", "training, evaluation or leaderboard.", required=True),
    Column("stream", "str", "", "Which evaluation or submission: its stamp or folder; empty in a training."),
    Column("worker", "int32", "", "Which of several simulators that train together, counted from 0.", required=True),
    Column("iteration", "int32", "", "Iteration of the training, counted from 0 as in AWS's file names."),
    Column("episode", "int32", "", "Episode as the log numbers it: of this worker, counted from 0.", required=True),
    Column(
        "unique_episode", "int32", "",
        "Episode of the whole table, counted from 0 without gaps: by round, phase, stream, iteration, worker.",
        required=True,
    ),
    *(_EPISODE[name] for name in _TICK_NAMES),
    Column("file", "uint32", "", "Index of the file among `Logs.files`.", required=True),
    Column("line", "int32", "", "Line in that file, counted from 1.", required=True),
)  # fmt: skip

METRIC_COLUMNS: tuple[Column, ...] = (
    Column("round", "int32", "", "Which of several trainings, counted from 1.", required=True),
    Column("phase", "str", "", "training or evaluation; evaluation rows of a training stand between its iterations."),
    Column("stream", "str", "", "Which evaluation: its stamp; empty in a training's file."),
    Column("worker", "int32", "", "Which of several simulators, counted from 0."),
    Column("iteration", "int32", "", "Iteration of the training, counted from 0."),
    Column("episode", "int32", "", "Episode of the training, counted from 0; in an evaluation its lap."),
    Column("trial", "int32", "", "Episode within the iteration, counted from 1."),
    Column("reward", "float64", "", "Sum of the rewards, rounded by AWS; absent in an evaluation's file."),
    Column("steps", "int32", "", "Ticks of it; told by Coach's CSV alone."),
    Column("start_s", "float64", "s", "Simulated time at which it began."),
    Column("seconds", "float64", "s", "How long it took."),
    Column("progress_share", "float64", "lap", "Share of the lap covered, cut to whole percent by AWS."),
    Column("status", "str", "", "How it ended, in the words of `status` above."),
    Column("resets", "int32", "", "How often the car was set back on the road, in an evaluation."),
    Column("file", "uint32", "", "Index of the file among `Logs.files`.", required=True),
)


def schema(columns: tuple[Column, ...]) -> dict[str, Any]:
    """Return the Polars types of a table's columns."""
    import polars as pl

    words = {"status": pl.Enum(STATUSES), "phase": pl.Enum(PHASES)}
    types = {
        "int32": pl.Int32(), "uint32": pl.UInt32(), "float64": pl.Float64(), "float32": pl.Float64(),
        "bool": pl.Boolean(), "str": pl.String(),
    }  # fmt: skip
    return {column.name: words.get(column.name, types[column.dtype]) for column in columns}


def empty(columns: tuple[Column, ...]) -> pl.DataFrame:
    """Return a table of no rows."""
    import polars as pl

    return pl.DataFrame(schema=schema(columns))
