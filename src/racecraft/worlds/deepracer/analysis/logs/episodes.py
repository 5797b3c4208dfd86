"""One row an episode, the table that most plots begin from. Begin with `simulation_agg`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from racecraft.worlds.deepracer.analysis.logs.plot import only, was_set_down

if TYPE_CHECKING:
    import polars as pl

FULL = 1.0 - 1e-9
QUINTILES = ("1st", "2nd", "3rd", "4th", "5th")
ORIGIN = ("round", "phase", "stream", "worker", "iteration", "episode", "unique_episode")


def simulation_agg(ticks: pl.DataFrame | pl.LazyFrame) -> pl.DataFrame:
    """Return one row an episode.

    Columns: where it comes from (round, phase, stream, worker, iteration, episode, unique_episode); `steps`;
    `start_at` and `end_at` (waypoints as recorded); `progress_share`; `seconds` (simulated; a lap that goes on from the
    one before is timed from that one's end); `distance_m` (driven, without steps by which the car was set down
    elsewhere); `speed_mps` (mean commanded); `reward` and `reward_per_step`; `seconds_if_complete` and
    `reward_if_complete` (scaled to a whole lap; null without progress); `complete`; `status` (how it ended);
    `off_track` and `crashed` (how often); `x_m`, `y_m` (where it ended); `quintile` (fifth of the episodes of its
    phase, "1st" to "5th").

    Raises:
        PlotError: There are no ticks, or columns are missing.
    """
    import polars as pl

    frame = only(
        ticks, *ORIGIN, "tick", "time_s", "x_m", "y_m", "speed_mps", "reward", "progress_share", "status",
        "closest_waypoint",
    )  # fmt: skip
    held = (pl.col("status") == "prepare").fill_null(False)
    elsewhere = (pl.col(name).ne_missing(pl.col(name).shift()) for name in ("round", "phase", "stream", "worker"))
    fresh = pl.any_horizontal(held, *elsewhere)
    is_first = pl.col("unique_episode") != pl.col("unique_episode").shift()
    fresh = fresh | (is_first & (pl.col("phase") == "training")).fill_null(True)
    steps = pl.when(fresh).then(0.0)
    dx, dy = (pl.col(name) - pl.col(name).shift() for name in ("x_m", "y_m"))
    moved = frame.with_columns(
        pl.when(~fresh).then((dx * dx + dy * dy).sqrt()).alias("_metres"),
        steps.otherwise(pl.col("time_s") - pl.col("time_s").shift()).alias("_seconds"),
        fresh.alias("_fresh"),
    )
    down = moved["_fresh"] | was_set_down(moved["unique_episode"], moved["_metres"])
    moved = moved.with_columns(pl.when(down).then(0.0).otherwise(pl.col("_metres")).alias("_metres"))
    table = moved.group_by("unique_episode", maintain_order=True).agg(
        *(pl.col(name).first() for name in ORIGIN if name != "unique_episode"),
        pl.len().cast(pl.Int32).alias("steps"),
        pl.col("closest_waypoint").first().alias("start_at"),
        pl.col("closest_waypoint").last().alias("end_at"),
        pl.col("progress_share").max(),
        pl.col("_seconds").sum().alias("seconds"),
        pl.col("_metres").sum().alias("distance_m"),
        pl.col("speed_mps").mean(),
        pl.col("reward").sum(),
        pl.col("status").last(),
        (pl.col("status") == "off_track").sum().cast(pl.Int32).alias("off_track"),
        (pl.col("status") == "crashed").sum().cast(pl.Int32).alias("crashed"),
        pl.col("x_m").last(),
        pl.col("y_m").last(),
    )
    return table.select(*ORIGIN, pl.exclude(*ORIGIN)).with_columns(*_derived())


def _derived() -> list[pl.Expr]:
    import polars as pl

    share = pl.when(pl.col("progress_share") > 0).then(pl.col("progress_share"))
    rank = pl.int_range(pl.len()).over("phase") * 5 // pl.len().over("phase")
    return [
        (pl.col("reward") / pl.col("steps")).alias("reward_per_step"),
        (pl.col("seconds") / share).alias("seconds_if_complete"),
        (pl.col("reward") / share).alias("reward_if_complete"),
        (pl.col("progress_share") >= FULL).alias("complete"),
        rank.replace_strict(list(range(5)), list(QUINTILES), return_dtype=pl.Enum(QUINTILES)).alias("quintile"),
    ]


def per_iteration(episodes: pl.DataFrame) -> pl.DataFrame:
    """Return one row an iteration of each round.

    Columns: round, iteration, `episodes`, mean and spread (`_std`) of reward, seconds and progress, `complete_share`,
    `lap_seconds` (mean of the full laps), `best_lap_seconds`.
    """
    import polars as pl

    full = pl.col("seconds").filter(pl.col("complete"))
    return episodes.group_by("round", "iteration").agg(
        pl.len().alias("episodes"),
        *(pl.col(name).mean().alias(name) for name in ("reward", "seconds", "progress_share")),
        *(pl.col(name).std().alias(f"{name}_std") for name in ("reward", "seconds", "progress_share")),
        pl.col("complete").mean().alias("complete_share"),
        full.mean().alias("lap_seconds"),
        full.min().alias("best_lap_seconds"),
    ).sort("round", "iteration").with_row_index("master_iteration")  # fmt: skip
