"""The functions of the workshops of 2018 and 2019 over files of today, under their names. Begin with `load_data`.

They keep what notebooks of that time expect: places in centimetres, angles in degrees, `throttle` for speed, iterations
counted from 1. `ticks_of` leads from there to the tables of today.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.logs.read import read
from racecraft.worlds.deepracer.logs.sources import LOG

if TYPE_CHECKING:
    import polars as pl

EPISODE_PER_ITER = 20
MARK = "SIM_TRACE_LOG:"
CM = 100.0
FIELDS = (
    "episode", "steps", "x", "y", "yaw", "steer", "throttle", "action", "reward", "done", "on_track", "progress",
    "closest_waypoint", "track_len", "timestamp",
)  # fmt: skip
"""What stands in a row of a simulation log, in order."""


def load_data(fname: str | Path) -> list[str]:
    """Return the rows of a simulation log, the text behind each `SIM_TRACE_LOG:`; of any other log, rows like them.

    Raises:
        LogError: There is no log at the path, or not one tick in it.
    """
    sources = read(fname).sources
    if all(source.kind == LOG for source in sources):
        text = Path(fname).read_text(encoding="utf-8", errors="replace")
        rows = [line.split(MARK, 1)[1].split("\t")[0].rstrip() for line in text.splitlines() if MARK in line]
        if rows:
            return rows
    return rows_of(read(fname).require_ticks())


def convert_to_pandas(data: Iterable[str], wpts: Any = None, episodes_per_iteration: int = EPISODE_PER_ITER) -> Any:
    """Return rows from `load_data` as a pandas table: `x` and `y` in cm, `yaw` and `steer` in degrees.

    Args:
        data: The rows.
        wpts: Not looked at; old notebooks hand the waypoints over.
        episodes_per_iteration: How many episodes an iteration had.
    """
    import pandas as pd  # type: ignore[import-untyped]

    table = pd.DataFrame([_fields(row) for row in data], columns=list(FIELDS))
    kinds = {"episode": int, "steps": int, "closest_waypoint": int}
    numbers = [name for name in FIELDS if name not in kinds and name not in ("done", "on_track", "action")]
    table = table.astype({**kinds, **dict.fromkeys(numbers, float)})
    table["action"] = pd.to_numeric(table["action"], errors="coerce").fillna(-1.0)
    table["done"] = (table["done"] == "True").astype(int) | (table["done"] == "1").astype(int)
    table["x"], table["y"] = CM * table["x"], CM * table["y"]
    table.insert(0, "iteration", table["episode"] // episodes_per_iteration + 1)
    return table


def episode_parser(data: Iterable[str]) -> tuple[dict[int, Any], dict[int, Array], list[int]]:
    """Return (places by action, ticks by episode, episodes by reward, the best first).

    The first is a dictionary of lists of [x, y, reward] in m, the second one of arrays (T, 6): x, y, action, reward,
    steering, speed. No row of noughts stands before the ticks, as it did.
    """
    places: dict[int, list[list[float]]] = {}
    ticks: dict[int, list[list[float]]] = {}
    for row in data:
        fields = dict(zip(FIELDS, _fields(row), strict=True))
        x, y, reward, angle, speed = (float(fields[name]) for name in ("x", "y", "reward", "steer", "throttle"))
        action = int(float(fields["action"])) if fields["action"].replace(".", "").replace("-", "").isdigit() else -1
        places.setdefault(action, []).append([x, y, reward])
        ticks.setdefault(int(fields["episode"]), []).append([x, y, action, reward, angle, speed])
    arrays = {number: np.array(rows) for number, rows in ticks.items()}
    best = sorted(arrays, key=lambda number: (-float(arrays[number][:, 3].sum()), number))
    return places, arrays, best


def get_closest_waypoint(x: float, y: float, waypoints: Array) -> int:
    """Return the number of the waypoint (K, 2 or more) that lies nearest."""
    return int(np.hypot(*(np.asarray(waypoints)[:, :2] - [x, y]).T).argmin())


def ticks_of(table: Any) -> pl.DataFrame:
    """Return a table of `convert_to_pandas` as today's ticks: metres, radians, iterations counted from 0."""
    import polars as pl

    old = pl.DataFrame({str(name): table[name].to_numpy() for name in table.columns if name != "on_track"})
    done = pl.col("done") == 1
    share = pl.col("progress") / 100.0
    ended = pl.when(share >= 1.0).then(pl.lit("lap_complete")).otherwise(pl.lit("off_track"))
    ended = pl.when(done).then(ended).otherwise(pl.lit("in_progress"))
    status = pl.when(pl.col("steps") == pl.col("steps").min().over("episode")).then(pl.lit("prepare")).otherwise(ended)
    return old.with_columns((pl.col("iteration") != pl.col("iteration").shift()).fill_null(False)).select(
        pl.lit(1, pl.Int32).alias("round"), pl.lit("training").alias("phase"), pl.lit("").alias("stream"),
        pl.lit(0, pl.Int32).alias("worker"), pl.Series("iteration", table["iteration"].to_numpy() - 1).cast(pl.Int32),
        pl.col("episode").cast(pl.Int32), (pl.col("episode").rank("dense") - 1).cast(pl.Int32).alias("unique_episode"),
        pl.col("steps").cast(pl.Int32).alias("tick"), pl.col("timestamp").alias("time_s"),
        (pl.col("x") / CM).alias("x_m"), (pl.col("y") / CM).alias("y_m"), pl.col("yaw").radians().alias("yaw_rad"),
        pl.col("steer").radians().alias("steering_rad"), pl.col("throttle").alias("speed_mps"),
        pl.col("action").cast(pl.Int32), "reward", done.alias("done"), status.alias("status"),
        share.alias("progress_share"), pl.col("closest_waypoint").cast(pl.Int32),
        pl.col("track_len").alias("track_length_m"),
    )  # fmt: skip


def _fields(row: str) -> list[str]:
    """Return the fields of a row that old notebooks know; later logs have more behind them.

    Raises:
        LogError: There are too few.
    """
    parts = [part.strip() for part in row.split(MARK)[-1].rstrip().split(",")]
    if len(parts) < len(FIELDS):
        raise LogError(
            "a row of the log",
            repr(row),
            Message("{count} fields: {fields}", count=len(FIELDS), fields=", ".join(FIELDS)),
            "Leave it out.",
        )
    return parts[: len(FIELDS)]


def rows_of(ticks: pl.DataFrame) -> list[str]:
    """Return ticks as rows of a simulation log, in AWS's order and units; episodes are counted from 0."""
    import polars as pl

    table = ticks.select(
        pl.col("unique_episode") - pl.col("unique_episode").min(), "tick",
        pl.col("x_m").round(4), pl.col("y_m").round(4),
        pl.col("yaw_rad").degrees().round(4), pl.col("steering_rad").degrees().round(2), pl.col("speed_mps").round(2),
        "action", pl.col("reward").round(4),
        pl.when(pl.col("done")).then(pl.lit("True")).otherwise(pl.lit("False")).alias("done"),
        pl.when(pl.col("all_wheels_on_track")).then(pl.lit("True")).otherwise(pl.lit("False")).alias("on_track"),
        (100.0 * pl.col("progress_share")).round(4), pl.col("closest_waypoint").fill_null(0),
        pl.col("track_length_m").round(2), "time_s",
    )  # fmt: skip
    return [",".join(map(str, row)) for row in table.iter_rows()]
