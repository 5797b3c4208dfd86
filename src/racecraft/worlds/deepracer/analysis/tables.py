"""Tables made from episode files: laps, actions, places where cars left the road. Begin with `load_episodes`.

Pure functions: each takes the ticks (see `formats/episodes.py`) and returns a new polars table.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.contract.errors import UserInputError
from racecraft.formats.episodes import read_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.drive import GRIEF, LAP_COMPLETE, STILL_DRIVING
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS

if TYPE_CHECKING:
    import polars as pl

TICK_COLUMNS = (
    "episode", "world", "iteration", "tick", "x_m", "y_m", "yaw_rad", "steering_rad", "speed_mps", "velocity_mps",
    "action", "reward", "done", "status", "progress_share", "closest_waypoint",
)  # fmt: skip
"""What the tables of this room are made from."""


class TableError(UserInputError):
    """Ticks of which a table cannot be made."""


def load_episodes(run: RunFolder, last_rows: int | None = None) -> pl.DataFrame:
    """Return the ticks of a run in the order they were written: TICK_COLUMNS, as far as the files have them.

    Args:
        run: The run folder.
        last_rows: Leave out the oldest files once the newer ones hold so many rows; None: all.

    Raises:
        EpisodeFileError: A file is damaged, foreign, or of a newer version.
    """
    import polars as pl

    parts: list[pl.DataFrame] = []
    for path in sorted(run.episodes.glob("*.parquet"), key=_number, reverse=True):
        if last_rows is not None and sum(part.height for part in parts) >= last_rows:
            break
        whole = read_episodes(path)
        parts.append(whole.select([name for name in TICK_COLUMNS if name in whole.columns]))
    if not parts:
        return pl.DataFrame()
    return pl.concat(parts[::-1], how="diagonal")


def laps_table(episodes: pl.DataFrame) -> pl.DataFrame:
    """Return one row an episode that ended, in the order of `episodes`.

    Columns: `world`, `episode`, `iteration` (of its end), `ticks` (seen here), `whole` (its first tick is here too),
    `lap_seconds` (null unless a full lap; a lap is as long as its ticks), `progress_percent`, `mean_speed_mps` (driven,
    without the tick in which the car is held), `reward`, `status`, and where it ended: `x_m`, `y_m`, `waypoint`.

    Raises:
        TableError: A column is missing.
    """
    import polars as pl

    _require(episodes, "episode", "tick", "x_m", "y_m", "velocity_mps", "reward", "status", "progress_share")
    ticks = _with_default_columns(episodes)
    laps = ticks.group_by("world", "episode", maintain_order=True).agg(
        pl.col("iteration").last(),
        pl.len().alias("ticks"),
        (pl.col("tick").first() == 1).alias("whole"),
        pl.col("tick").last().alias("_last_tick"),
        (100.0 * pl.col("progress_share").last()).clip(0.0, 100.0).alias("progress_percent"),
        pl.col("velocity_mps").filter(pl.col("status") != "prepare").mean().alias("mean_speed_mps"),
        pl.col("reward").sum(),
        pl.col("status").last(),
        pl.col("x_m").last(),
        pl.col("y_m").last(),
        pl.col("closest_waypoint").last().alias("waypoint"),
        pl.col("done").last().alias("_done"),
    )
    going = pl.col("status").is_in(STILL_DRIVING)
    lap_seconds = pl.when(pl.col("status") == LAP_COMPLETE).then(TICK_SECONDS * pl.col("_last_tick"))
    return (
        laps.filter(pl.col("_done") | ~going)
        .with_columns(
            lap_seconds.alias("lap_seconds"),
            pl.when(going).then(pl.lit("time_up")).otherwise(pl.col("status")).alias("status"),
        )
        .select(
            "world", "episode", "iteration", "ticks", "whole", "lap_seconds", "progress_percent", "mean_speed_mps",
            "reward", "status", "x_m", "y_m", "waypoint",
        )
    )  # fmt: skip


def action_table(episodes: pl.DataFrame) -> pl.DataFrame:
    """Return how often each action was chosen: `action`, `steering_rad`, `speed_mps`, `count`, `share`, `mean_reward`.

    Ticks in which the car is held do not count. Rows are sorted by steering, left first, then by speed.

    Raises:
        TableError: A column is missing.
    """
    import polars as pl

    _require(episodes, "action", "steering_rad", "speed_mps", "reward", "status")
    chosen = episodes.filter((pl.col("status") != "prepare") & (pl.col("action") >= 0))
    return (
        chosen.group_by("action")
        .agg(
            pl.col("steering_rad").first(),
            pl.col("speed_mps").first(),
            pl.len().alias("count"),
            pl.col("reward").mean().alias("mean_reward"),
        )
        .with_columns((pl.col("count") / max(1, chosen.height)).alias("share"))
        .select("action", "steering_rad", "speed_mps", "count", "share", "mean_reward")
        .sort("steering_rad", "speed_mps", "action", descending=[True, False, False])
    )


def command_table(episodes: pl.DataFrame, bands: int = 7) -> pl.DataFrame:
    """Return where continuous commands lay: the range of angles that was chosen from, cut into bands of equal width.

    Columns are `steering_low_rad`, `steering_high_rad`, `speed_mps` (mean), `count`, `share`, `mean_reward`; the
    leftmost band comes first, and one that nobody chose is left out. Ticks in which the car is held do not count.

    Args:
        episodes: Rows with `action` -1, as of a continuous action space; others do not count.
        bands: How many.

    Raises:
        TableError: A column is missing.
    """
    import polars as pl

    _require(episodes, "action", "steering_rad", "speed_mps", "reward", "status")
    chosen = episodes.filter((pl.col("status") != "prepare") & (pl.col("action") < 0))
    low, high = chosen["steering_rad"].min() or 0.0, chosen["steering_rad"].max() or 0.0
    width = max(float(high) - float(low), 1e-9) / bands  # type: ignore[arg-type]
    band = ((pl.col("steering_rad") - low) / width).floor().clip(0, bands - 1)
    return (
        chosen.group_by(band.alias("band"))
        .agg(
            pl.col("speed_mps").mean(),
            pl.len().alias("count"),
            pl.col("reward").mean().alias("mean_reward"),
        )
        .with_columns(
            (low + pl.col("band") * width).alias("steering_low_rad"),
            (low + (pl.col("band") + 1) * width).alias("steering_high_rad"),
            (pl.col("count") / max(1, chosen.height)).alias("share"),
        )
        .sort("band", descending=True)
        .select("steering_low_rad", "steering_high_rad", "speed_mps", "count", "share", "mean_reward")
    )


def endings_table(laps: pl.DataFrame) -> pl.DataFrame:
    """Return how often episodes ended in which way, most frequent first: `status`, `count`, `share`."""
    import polars as pl

    counted = laps.group_by("status").agg(pl.len().alias("count"))
    counted = counted.with_columns((pl.col("count") / max(1, laps.height)).alias("share"))
    return counted.sort("count", "status", descending=[True, False])


def exits_table(laps: pl.DataFrame) -> pl.DataFrame:
    """Return where cars left the road or crashed, worst place first.

    Columns: `waypoint`, `count`, `mean_speed_mps` of those episodes.
    """
    import polars as pl

    off = laps.filter(pl.col("status").cast(pl.String).is_in(list(GRIEF)))
    counted = off.group_by("waypoint").agg(pl.len().alias("count"), pl.col("mean_speed_mps").mean())
    return counted.sort("count", "waypoint", descending=[True, False])


def _with_default_columns(episodes: pl.DataFrame) -> pl.DataFrame:
    """Fill in the columns that a file may lack."""
    import polars as pl

    usual = {"world": 0, "iteration": 0, "done": False, "closest_waypoint": None}
    lacking = [pl.lit(value).alias(name) for name, value in usual.items() if name not in episodes.columns]
    return episodes.with_columns(lacking)


def _require(episodes: pl.DataFrame, *names: str) -> None:
    missing = [name for name in names if name not in episodes.columns]
    if missing:
        raise TableError(
            "The episodes have no column {missing}; found {columns}. Files that racecraft wrote have them all.",
            missing=", ".join(missing),
            columns=", ".join(episodes.columns) or "none",
        )


def _number(path: Path) -> tuple[int, str]:
    return (int(path.stem), "") if path.stem.isdigit() else (-1, path.stem)
