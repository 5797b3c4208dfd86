"""Rows of the CSV that Coach kept of a training, one an episode. Begin with `read_coach_csv`.

AWS's trainings of 2019 left it beside their checkpoints, as
`worker_0.simple_rl_graph.main_level.main_level.agent_0.csv`. It tells rewards and lengths, and nothing of the road.

Source: the traces in Coach's repository.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.sources import Source

if TYPE_CHECKING:
    import polars as pl

EPISODE, ITERATION, LENGTH = "Episode #", "Training Iter", "Episode Length"
REWARD, JUDGED = "Training Reward", "Evaluation Reward"
COLUMNS = (EPISODE, ITERATION, LENGTH, REWARD, JUDGED)


def is_coach_csv(name: str) -> bool:
    """Tell whether a file that holds metrics is Coach's, by its ending.

    >>> is_coach_csv("worker_0.simple_rl_graph.main_level.main_level.agent_0.csv"), is_coach_csv("TrainingMetrics.json")
    (True, False)
    """
    return name.removesuffix(".gz").endswith(".csv")


def read_coach_csv(source: Source) -> tuple[pl.DataFrame, list[Damage]]:
    """Return the episodes of a training, and its evaluations: one row each, with the mean of their rewards.

    Returns:
        Columns of METRIC_COLUMNS: round, phase, stream, worker, iteration, episode, reward, steps; and what was
        damaged. Episodes of the heat-up have no reward.
    """
    import polars as pl

    try:
        text = source.read()
        cells = pl.read_csv(io.BytesIO(text), infer_schema=False, truncate_ragged_lines=True)
    except (OSError, pl.exceptions.PolarsError) as error:
        return pl.DataFrame(), [Damage(source.name, None, f"cannot be read ({error}); left out")]
    lacking = [name for name in COLUMNS if name not in cells.columns]
    if lacking:
        return pl.DataFrame(), [Damage(source.name, 1, f"no column {', '.join(lacking)}; left out")]
    rows = cells.with_row_index("line", 2).with_columns(pl.col(*COLUMNS).cast(pl.Float64, strict=False))
    known = pl.all_horizontal(pl.col(EPISODE, ITERATION, LENGTH).is_finite().fill_null(False))
    damage = [Damage(source.name, line, "no row of an episode; passed over") for line in rows.filter(~known)["line"]]
    rows = rows.filter(known)
    trained, judged = rows, rows.filter(pl.col(JUDGED).is_not_null())
    return pl.concat([_as_ours(trained, source, "training", REWARD),
                      _as_ours(judged, source, "evaluation", JUDGED)]), damage  # fmt: skip


def _as_ours(rows: pl.DataFrame, source: Source, phase: str, reward: str) -> pl.DataFrame:
    import polars as pl

    steps = pl.col(LENGTH) if phase == "training" else pl.lit(None)
    return rows.select(
        pl.lit(source.round).alias("round"),
        pl.lit(phase).alias("phase"),
        pl.lit(source.stream).alias("stream"),
        pl.lit(source.worker).alias("worker"),
        pl.col(ITERATION).cast(pl.Int32).alias("iteration"),
        pl.col(EPISODE).cast(pl.Int32).sub(1).alias("episode"),
        pl.col(reward).alias("reward"),
        steps.cast(pl.Int32).alias("steps"),
    )
