"""From the files of a training to one table of ticks. Begin with `read_ticks`.

traces, logs and episodes, in the order in which they happened → our names and units → phases → unique episodes
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.formats.episodes import FORMAT, VERSION
from racecraft.worlds.deepracer.logs.columns import PHASES, TICK_COLUMNS, empty, schema
from racecraft.worlds.deepracer.logs.continued import join_continued
from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.log_rows import read_log
from racecraft.worlds.deepracer.logs.numbering import number, phase_of_rows, without_repeated_rows
from racecraft.worlds.deepracer.logs.sources import EPISODES, LOG, TRACE, Source
from racecraft.worlds.deepracer.logs.trace_rows import read_traces
from racecraft.worlds.deepracer.logs.units import in_our_units

if TYPE_CHECKING:
    import polars as pl

OURS = {
    "episode": "episode", "steps": "tick", "X": "x_m", "Y": "y_m", "yaw": "yaw_rad", "steer": "steering_rad",
    "throttle": "speed_mps", "action": "action", "reward": "reward", "done": "done",
    "all_wheels_on_track": "all_wheels_on_track", "progress": "progress_share",
    "closest_waypoint": "closest_waypoint", "track_len": "track_length_m", "tstamp": "time_s",
    "episode_status": "status", "pause_duration": "pause_s", "obstacle_crash_counter": "obstacle_crashes",
    "wall_clock": "wall_clock_s",
}  # fmt: skip
"""AWS's name of a column → ours."""

RawRow = dict[str, Any]


def read_ticks(sources: Sequence[Source], phase: str | None = None) -> tuple[pl.DataFrame, list[Damage], RawRow]:
    """Read every tick.

    Args:
        sources: All files, in order; a row's `file` is an index among them.
        phase: What rows belong to whose path does not tell; None: the rows tell.

    Returns:
        The table of TICK_COLUMNS; what was damaged; and what logs say of world, hyperparameters and
        actions.
    """
    import polars as pl

    frames: list[pl.DataFrame] = []
    damage: list[Damage] = []
    metadata: RawRow = {}
    for kind, group in itertools.groupby(enumerate(sources), key=lambda pair: pair[1].kind):
        pairs = list(group)
        if kind == TRACE:
            trace, wrong = read_traces(pairs)
            frames += _placed(trace, pairs, phase)
            damage += wrong
        elif kind == LOG:
            says: RawRow = {}
            for place, source in pairs:
                rolled = source.part != 1 and place > 0 and sources[place - 1].part is not None
                trace, wrong, says = read_log(place, source, says if rolled else None)
                frames += _placed(trace, [(place, source)], phase or says.get("phase"))
                damage += wrong
                metadata = {**says, **metadata}
        elif kind == EPISODES:
            for place, source in pairs:
                ours, wrong = _own_episodes(place, source)
                frames += ours
                damage += wrong
    if not frames:
        return empty(TICK_COLUMNS), damage, metadata
    rows, repeated = without_repeated_rows(pl.concat(frames, how="diagonal"), sources)
    numbered = join_continued(number(rows))
    damage += repeated
    return _in_columns(numbered), damage, metadata


def _placed(trace: pl.DataFrame, pairs: list[tuple[int, Source]], phase: str | None) -> list[pl.DataFrame]:
    """Return AWS's rows under our names, with the columns that their files tell."""
    if not trace.height:
        return []
    known_phase = phase
    if known_phase is None and any(source.phase is None for _, source in pairs):
        known_phase = phase_of_rows(trace, is_first=not any(source.iteration for _, source in pairs))
    files = dict(pairs)
    runs = trace["file"].rle().struct.unnest()
    sources = [files[place] for place in runs["value"]]
    told_by_path: dict[str, list[Any]] = {
        "round": [source.round for source in sources],
        "phase": [source.phase or known_phase for source in sources],
        "stream": [source.stream for source in sources],
        "worker": [source.worker for source in sources],
        "iteration": [source.iteration for source in sources],
    }
    untold = {name: values for name, values in told_by_path.items() if name not in trace.columns}
    columns = [_repeated(name, values, runs["len"]) for name, values in untold.items()]
    named = in_our_units(trace).rename({theirs: ours for theirs, ours in OURS.items() if theirs in trace.columns})
    return [named.with_columns(columns)]


def _repeated(name: str, values: list[Any], counts: pl.Series) -> pl.Series | pl.Expr:
    """Return each value so many times; one value for all rows takes no room."""
    import polars as pl

    kind = schema(TICK_COLUMNS)[name]
    if len(set(values)) == 1:
        return pl.lit(values[0], kind).alias(name)
    if kind.is_integer():
        return pl.Series(name, np.repeat(np.array(values, np.int32), counts.to_numpy()), kind)
    return pl.Series(name, values, kind).gather(np.repeat(np.arange(len(values), dtype=np.uint32), counts.to_numpy()))


def _own_episodes(place: int, source: Source) -> tuple[list[pl.DataFrame], list[Damage]]:
    """Read a file of our own episodes; a world is a worker, and iterations are counted from 0."""
    import polars as pl

    try:
        data = BytesIO(source.read())
        metadata = pl.read_parquet_metadata(data)
        data.seek(0)
        frame = pl.read_parquet(data)
    except (pl.exceptions.PolarsError, OSError) as error:
        return [], [Damage(source.name, None, f"damaged or half written ({error}); left out")]
    if metadata.get("format") != FORMAT or metadata.get("version") != str(VERSION):
        return [], [Damage(source.name, None, "no file of racecraft's episodes; left out")]
    known = schema(TICK_COLUMNS)
    frame = frame.select(
        *(pl.col(name).cast(known[name], strict=False) for name in frame.columns if name in known),
        *([pl.col("world").cast(pl.Int32).alias("worker")] if "world" in frame.columns else []),
    )
    lacking = {"worker": 0, "iteration": 1}
    frame = frame.with_columns(pl.lit(value, pl.Int32).alias(k) for k, value in lacking.items() if k not in frame)
    return [
        frame.with_columns(
            pl.lit(source.round, pl.Int32).alias("round"),
            pl.lit(source.phase or "training").cast(pl.Enum(PHASES)).alias("phase"),
            pl.lit("").alias("stream"),
            (pl.col("iteration") - 1).clip(0),
            pl.lit(place, pl.UInt32).alias("file"),
            pl.int_range(1, pl.len() + 1, dtype=pl.Int32).alias("line"),
        ).sort("iteration", "worker", "episode", "tick")
    ], []


def _in_columns(frame: pl.DataFrame) -> pl.DataFrame:
    """Return the table with all its columns, in their order; what no file has is null."""
    import polars as pl

    known = schema(TICK_COLUMNS)
    return frame.with_columns(
        pl.col(name).cast(kind) if name in frame.columns else pl.lit(None, kind).alias(name)
        for name, kind in known.items()
    ).select(list(known))
