"""Rows of metrics files, one an episode: AWS's, and Coach's CSV. Begin with `read_metrics`.

In a training's file `trial` begins at 1 again in every iteration, which is how iterations are told; files of further
workers count trials on, and go by the length of the first worker's iterations. Evaluation rows stand between.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from racecraft.formats.json_text import parse_json
from racecraft.worlds.deepracer.files.training_metrics import STATUS_LABELS
from racecraft.worlds.deepracer.logs.coach_csv import is_coach_csv, read_coach_csv
from racecraft.worlds.deepracer.logs.columns import METRIC_COLUMNS, PHASES, empty, schema
from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.sources import METRICS, Source

if TYPE_CHECKING:
    import polars as pl

_STATUS = {label.casefold(): word for word, label in STATUS_LABELS.items()}
_NUMBERS = (
    "trial", "episode", "reward_score", "start_time", "metric_time", "elapsed_time_in_milliseconds",
    "completion_percentage", "reset_count",
)  # fmt: skip
_NEEDED = ("trial", "start_time", "completion_percentage")


def read_metrics(sources: Sequence[Source], phase: str | None = None) -> tuple[pl.DataFrame, list[Damage]]:
    """Return the table of METRIC_COLUMNS of all metrics files, and what was damaged."""
    import polars as pl

    frames, damage = [], []
    length: dict[int, int] = {}
    for place, source in enumerate(sources):
        if source.kind != METRICS:
            continue
        if is_coach_csv(source.name):
            frame, wrong = read_coach_csv(source)
        else:
            rows, wrong = _rows(source)
            frame = _as_ours(rows, source, phase, length) if rows.height else rows
        damage += wrong
        if frame.height:
            frames.append(frame.with_columns(pl.lit(place, pl.UInt32).alias("file")))
    if not frames:
        return empty(METRIC_COLUMNS), damage
    known = schema(METRIC_COLUMNS)
    whole = pl.concat(frames, how="diagonal_relaxed")
    return whole.select(
        pl.col(name).cast(kind) if name in whole.columns else pl.lit(None, kind).alias(name)
        for name, kind in known.items()
    ), damage


def _rows(source: Source) -> tuple[pl.DataFrame, list[Damage]]:
    """Return the rows of a file as AWS has them, numbers as floats; rows that lack what is needed are passed over."""
    import polars as pl

    try:
        value = parse_json(source.read())
    except (ValueError, OSError) as error:
        line = getattr(error, "lineno", None)
        return pl.DataFrame(), [Damage(source.name, line, f"no valid JSON ({error}); left out")]
    rows = value.get("metrics") if isinstance(value, dict) else None
    if not isinstance(rows, list):
        return pl.DataFrame(), [Damage(source.name, 1, 'there is no list "metrics"; left out')]
    sound = [row for row in rows if _is_sound(row)]
    damage = [
        Damage(source.name, None, f"row {k} of the metrics lacks one of {', '.join(_NEEDED)}; passed over")
        for k, row in enumerate(rows, 1)
        if not _is_sound(row)
    ]
    columns: dict[str, Any] = {name: [_number(row.get(name)) for row in sound] for name in _NUMBERS}
    columns["label"] = [str(row.get("episode_status", "")).casefold() for row in sound]
    columns["phase"] = [row.get("phase") for row in sound]
    return pl.DataFrame(columns, schema_overrides={name: pl.Float64 for name in _NUMBERS}), damage


def _is_sound(row: Any) -> bool:
    return isinstance(row, dict) and all(_number(row.get(name)) is not None for name in _NEEDED)


def _number(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _as_ours(rows: pl.DataFrame, source: Source, phase: str | None, length: dict[int, int]) -> pl.DataFrame:
    import polars as pl

    is_training = bool(rows["phase"].is_not_null().any())
    row_phase = (source.phase if source.phase else phase) or ("training" if is_training else "evaluation")
    training = pl.col("phase").fill_null(row_phase) == "training"
    if source.worker == 0 and is_training:
        length[source.round] = int(rows.filter(training)["trial"].max() or 1)  # type: ignore[arg-type]
    if source.worker == 0 or source.round not in length:
        restarts = training & (pl.col("trial") <= pl.col("trial").shift().fill_null(0.0))
        iteration = restarts.cum_sum()
    else:
        iteration = (pl.col("episode") - 1) // length[source.round]
    ended = pl.col("metric_time") - pl.col("start_time")
    return rows.select(
        pl.lit(source.round).alias("round"),
        pl.col("phase").fill_null(row_phase).cast(pl.Enum(PHASES), strict=False),
        pl.lit(source.stream).alias("stream"),
        pl.lit(source.worker).alias("worker"),
        (iteration if is_training else pl.lit(0)).alias("iteration"),
        pl.coalesce("episode", "trial").sub(1).alias("episode"),
        "trial",
        pl.col("reward_score").alias("reward"),
        (pl.col("start_time") / 1000.0).alias("start_s"),
        (pl.coalesce("elapsed_time_in_milliseconds", ended) / 1000.0).alias("seconds"),
        (pl.col("completion_percentage") / 100.0).alias("progress_share"),
        pl.col("label").replace_strict(_STATUS, default=None).alias("status"),
        pl.col("reset_count").alias("resets"),
    )
