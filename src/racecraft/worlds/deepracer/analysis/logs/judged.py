"""What a training's evaluations say: how far its car came when it drove without exploring. Begin with `Judged`.

A training's own episodes explore, and fail by that long after the car can drive: what is wrong with a training is told
by both together.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from racecraft.worlds.deepracer.analysis.logs.episodes import FULL, simulation_agg

if TYPE_CHECKING:
    import polars as pl

ROUND = 0.95
"""Mean progress of an evaluation from which its car gets round, share of a lap."""
LATEST = 2
"""So many evaluations, the latest, have to get round."""
PER_CENT = 100.0


@dataclass(frozen=True)
class Evaluations:
    """The evaluations of a training, in their order."""

    shares: tuple[float, ...] = ()
    """Mean progress of each, share of a lap."""
    best_lap_seconds: float | None = None
    """The fastest full lap, as `best_lap_seconds` has it; None: there was none, or times are not told."""

    @property
    def completes_laps(self) -> bool:
        """Whether the car laps when it does not explore, by the latest evaluations.

        >>> [Evaluations(progress).completes_laps for progress in ((0.2, 1.0, 0.98), (1.0, 0.6), ())]
        [True, False, False]
        """
        return bool(self.shares) and min(self.shares[-LATEST:]) >= ROUND

    def words(self) -> str:
        """Return a sentence of what the latest evaluations came to; "" where there was none.

        >>> Evaluations((0.2, 1.0, 0.98), 14.5).words()
        'Judged without exploration, its last 2 evaluations came to 100 % and 98 % of a lap. Its best lap took 14.50 s.'
        """
        if not self.shares:
            return ""
        last = self.shares[-LATEST:]
        came = " and ".join(f"{PER_CENT * share:.0f} %" for share in last)
        count = f"last {len(last)} evaluations" if len(last) > 1 else "evaluation"
        lap = f" Its best lap took {self.best_lap_seconds:.2f} s." if self.best_lap_seconds else ""
        return f"Judged without exploration, its {count} came to {came} of a lap.{lap}"


def judged_in_run(metrics: Sequence[Mapping[str, Any]]) -> Evaluations:
    """Return the evaluations of a run of cars, by its metrics.jsonl."""
    evaluated = [row for row in metrics if row.get("evaluation_score") is not None]
    shares = tuple(float(row["evaluation_score"]) / PER_CENT for row in evaluated)
    return Evaluations(shares, fastest_evaluated_lap(evaluated))


def fastest_evaluated_lap(metrics: Iterable[Mapping[str, Any]]) -> float | None:
    """Return the fastest full lap of a run's evaluations, from rest or flying, s; None: there was none.

    On several tracks flying laps alone count once there are any: all of them are of the first track.

    >>> fastest_evaluated_lap([{"best_lap_seconds": 6.87, "flying_lap_seconds": 6.73}, {"best_lap_seconds": 6.4}])
    6.4
    >>> several = {"trained_tracks_lapped": 1.0, "best_lap_seconds": 6.4, "flying_lap_seconds": 8.1}
    >>> fastest_evaluated_lap([several])
    8.1
    """
    rows = list(metrics)
    flying = [float(row["flying_lap_seconds"]) for row in rows if row.get("flying_lap_seconds")]
    if flying and any("trained_tracks_lapped" in row for row in rows):
        return min(flying)
    return min(
        [*flying, *(float(row["best_lap_seconds"]) for row in rows if row.get("best_lap_seconds"))], default=None
    )


def judged_in_log(ticks: pl.DataFrame, metrics: pl.DataFrame | None) -> Evaluations:
    """Return the evaluations that a log tells of.

    Those between a training's iterations, by the metrics files, of the latest round; where there is none, evaluations
    that were driven by themselves, by the steps.

    Args:
        ticks: The table of `racecraft.worlds.deepracer.logs`.
        metrics: Its table of metrics files; None: there are none.
    """
    import polars as pl

    share = pl.col("progress_share")
    evaluated = pl.DataFrame() if metrics is None else metrics.filter(pl.col("phase") == "evaluation")
    trained = pl.DataFrame() if metrics is None else metrics.filter(pl.col("phase") == "training")
    if evaluated.height and trained.height:
        latest = evaluated.filter(pl.col("round") == evaluated["round"].max())
        rows = latest.group_by("iteration", maintain_order=True).agg(share.mean()).sort("iteration")
    else:
        driven = ticks.filter(pl.col("phase") == "evaluation")
        if not driven.height:
            return Evaluations()
        rows = simulation_agg(driven).group_by("round", "stream", maintain_order=True).agg(share.mean())
    return Evaluations(tuple(rows["progress_share"].to_list()), best_lap_seconds(simulation_agg(ticks), metrics))


def best_lap_seconds(episodes: pl.DataFrame, metrics: pl.DataFrame | None) -> float | None:
    """Return the fastest full lap that a log tells of, explored or judged, by its steps or by its metrics files.

    Args:
        episodes: `simulation_agg` of its steps.
        metrics: Its table of metrics files; None: there are none.
    """
    tables = [episodes] if metrics is None else [episodes, metrics]
    laps = [table["seconds"].filter(table["progress_share"] >= FULL).min() for table in tables]
    return min((float(lap) for lap in laps if lap is not None), default=None)  # type: ignore[arg-type]
