"""What happened, one row a tick, as a Parquet file.

Begin with `EPISODE_COLUMNS`, the one table of columns: name, type, unit, one sentence. `write_episodes` takes a
dictionary of arrays, `read_episodes` gives the table back, by name. A file may lack columns that are not `required`
and may hold others of the writer's own; readers pass over what they do not know.

Every column that an AWS simulation trace needs is here, so that such a trace can be made from any file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.contract.errors import ContractError, InputFileError
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.formats.atomic import write_atomic

if TYPE_CHECKING:
    import polars as pl

FORMAT = "racecraft episodes"
VERSION = 1


class EpisodeFileError(InputFileError):
    """A file of episodes is missing, damaged, or of another kind."""


@dataclass(frozen=True)
class Column:
    """One column of a table for strangers."""

    name: str
    dtype: str
    """NumPy's name of the type; "str" for text, "struct" for a record of numbers."""
    unit: str
    doc: str
    required: bool = False


STATUSES = (
    "prepare",
    "in_progress",
    "lap_complete",
    "off_track",
    "crashed",
    "immobilized",
    "reversed",
    "time_up",
    "pause",
    "park",
)
"""Words of the column `status`, as AWS writes them."""

EPISODE_COLUMNS = (
    Column("episode", "int32", "", "Episode of this world, counted from 0 without gaps.", required=True),
    Column("world", "int32", "", "World the car drove in, counted from 0; worlds run side by side."),
    Column("agent", "int32", "", "Car of that world, counted from 0; absent where every world has one."),
    Column("iteration", "int32", "", "Iteration of the training, counted from 1."),
    Column(
        "tick", "int32", "", "Tick within the episode, counted from 1; the first is the start at rest.", required=True
    ),
    Column("time_s", "float64", "s", "Simulated time since the run began.", required=True),
    Column("x_m", "float64", "m", "Position of the car's front point, east."),
    Column("y_m", "float64", "m", "Position of the car's front point, north."),
    Column("yaw_rad", "float64", "rad", "Heading, counter-clockwise from east, -pi to pi."),
    Column("steering_rad", "float64", "rad", "Commanded front-wheel angle, positive left."),
    Column("speed_mps", "float64", "m/s", "Commanded speed."),
    Column("velocity_mps", "float32", "m/s", "Speed the car really had."),
    Column("action", "int32", "", "Number of the action in the car's list; -1 where the action space is continuous."),
    Column("reward", "float64", "", "What the reward function paid for this tick."),
    Column("done", "bool", "", "Whether this is the episode's last tick."),
    Column("status", "str", "", "How the episode stands: " + ", ".join(STATUSES) + "."),
    Column("all_wheels_on_track", "bool", "", "Whether all four wheels are inside the borders."),
    Column("progress_share", "float64", "lap", "Share of the lap covered since the episode's start, 0 to 1."),
    Column("closest_waypoint", "int32", "", "Index of the nearest waypoint of the centre line."),
    Column("distance_from_center_m", "float32", "m", "Distance from the centre line, 0 or more."),
    Column("track_length_m", "float64", "m", "Length of the centre line."),
    Column("pause_s", "float32", "s", "Pause after a penalty, in evaluations."),
    Column("obstacle_crashes", "int32", "", "Obstacles hit so far in this episode."),
    Column(
        "variation",
        "struct",
        "",
        "What this episode drew where episodes differ: a number each, float32, by the names of the page on variation; "
        "absent where they are all alike.",
    ),
    Column(
        "objects",
        "struct",
        "",
        "Where boxes and bots stood, in their order: x_0, y_0 (m), yaw_0 (rad), x_1 and so on, float32, nan where this "
        "course has fewer; absent where the road is empty.",
    ),
    Column("wall_clock_s", "float64", "s", "Time of day, seconds since 1970 (UTC)."),
)


def columns_of_all(parts: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Return several tables, one below the other. Records take the numbers of the part that has most of them.

    Where others lack a number, `objects` says nan and `variation` 0, as where a course has fewer.
    """
    lengths = [len(part["episode"]) for part in parts]
    names = dict.fromkeys(name for part in parts for name in part)
    return {name: _below(name, [part.get(name) for part in parts], lengths) for name in names}


def _below(name: str, columns: Sequence[Array | None], lengths: Sequence[int]) -> Array:
    found = [column for column in columns if column is not None]
    widest = max((column.dtype for column in found), key=lambda dtype: len(dtype.names or ()))
    if widest.names is None:
        return np.concatenate(found)
    whole = np.zeros(sum(lengths), widest)
    if name == "objects":
        whole[:] = tuple(np.nan for _ in widest.names)
    ends = np.cumsum(lengths)
    for column, end, length in zip(columns, ends, lengths, strict=True):
        if column is not None:
            for number in column.dtype.names or ():
                whole[number][end - length : end] = column[number]
    return whole


def write_episodes(path: str | Path, columns: Mapping[str, Array]) -> None:
    """Write a table of T ticks.

    Args:
        path: Where to.
        columns: Arrays of shape (T,) by name. Known columns are brought to their type; others are kept as they are.

    Raises:
        ContractError: A required column is missing, or the columns differ in length or shape.
        OutputFileError: The file cannot be written.
    """
    import polars as pl

    known = {column.name: column for column in EPISODE_COLUMNS}
    missing = [column.name for column in EPISODE_COLUMNS if column.required and column.name not in columns]
    shapes = {name: np.shape(values) for name, values in columns.items()}
    if missing or len(set(shapes.values())) > 1 or any(len(shape) != 1 for shape in shapes.values()):
        raise ContractError(
            "Episodes need {missing}; got columns of the shapes {shapes}.",
            missing=missing or "columns of one length",
            shapes=shapes,
        )
    ordered = [name for name in known if name in columns] + [name for name in columns if name not in known]
    frame = pl.DataFrame({name: _typed(columns[name], known.get(name)) for name in ordered})
    whole = BytesIO()
    frame.write_parquet(whole, metadata={"format": FORMAT, "version": str(VERSION)})
    write_atomic(path, whole.getvalue())


def read_episodes(path: str | Path, columns: list[str] | None = None) -> pl.DataFrame:
    """Return the table, or only the columns named.

    Raises:
        EpisodeFileError: The file is missing, damaged, foreign or of a newer version, or lacks a column.
    """
    import polars as pl

    path = Path(path)
    expected = Message("a Parquet file of {format}", format=FORMAT)
    if not path.is_file():
        raise EpisodeFileError(path, "there is no such file", expected)
    try:
        metadata = pl.read_parquet_metadata(path)
        names = list(pl.read_parquet_schema(path))
    except (pl.exceptions.PolarsError, OSError) as error:
        raise EpisodeFileError(path, Message("damaged or half written ({error})", error=error), expected) from error
    if metadata.get("format") != FORMAT:
        raise EpisodeFileError(path, "a Parquet file of another kind", expected)
    if metadata.get("version") != str(VERSION):
        raise EpisodeFileError(
            path,
            Message("version {metadata}", metadata=metadata.get("version")),
            Message("version {version}", version=VERSION),
            "Upgrade racecraft.",
        )
    for name in columns or []:
        if name not in names:
            raise EpisodeFileError(
                path, "there is no such column", Message("one of {names}", names=", ".join(names)), key=name
            )
    try:
        return pl.read_parquet(path, columns=columns)
    except (pl.exceptions.PolarsError, OSError) as error:
        raise EpisodeFileError(path, Message("damaged or half written ({error})", error=error), expected) from error


def columns_markdown(columns: Sequence[Column] = EPISODE_COLUMNS) -> str:
    """Return the table of columns for the documentation."""
    rows = [f"| `{column.name}` | {column.dtype} | {column.unit} | {column.doc} |" for column in columns]
    return "\n".join(["| column | type | unit | meaning |", "|---|---|---|---|", *rows]) + "\n"


def _typed(values: Array, column: Column | None) -> Any:
    if (names := np.asarray(values).dtype.names) is not None:
        import polars as pl

        return pl.DataFrame({name: np.ascontiguousarray(values[name]) for name in names}).to_struct()
    if column is None:
        return values
    if column.dtype == "str":
        return [str(value) for value in values]
    return np.asarray(values).astype(column.dtype, copy=False)
