"""What AWS's metrics files tell without a single tick: completion, rewards and lap times over rounds and workers.

Begin with `metrics_summary`. Functions take `Logs.metrics`: one row an episode, training and the evaluations between.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.analysis.plot import Plot, PlotError, sheet
from racecraft.pages.colours import BLUE, CYCLE, ORANGE
from racecraft.worlds.deepracer.analysis.logs.plot import few, name_axes, require, values

if TYPE_CHECKING:
    import polars as pl

METHODS = ("mean", "median", "min", "max", "std")
FULL = 1.0


NO_METRICS = "There are no metrics of a training here; expected TrainingMetrics.json of one."


def metrics_summary(metrics: pl.DataFrame | pl.LazyFrame, method: str = "mean", rolling: int = 1) -> pl.DataFrame:
    """Return one row an iteration of each round, evaluation beside training.

    Columns: `round`, `iteration`, `master_iteration` (counted through all rounds), and for `training` and `evaluation`
    each: `_episodes`, `_progress_share`, `_reward`, `_seconds` (by the method), `_complete_share`, `_lap_seconds` (by
    the method, of full laps), `_best_lap_seconds`.

    Args:
        metrics: The metrics.
        method: How an iteration's episodes become one number, one of METHODS.
        rolling: Iterations that are averaged, each with those before it.

    Raises:
        PlotError: There are no metrics, the method is unknown, or `rolling` is below 1.
    """
    import polars as pl

    if method not in METHODS:
        raise PlotError(
            "method {method!r} is not known; expected one of {methods}.", method=method, methods=", ".join(METHODS)
        )
    if rolling < 1:
        raise PlotError("An average over {rolling} iterations is none; expected 1 or more.", rolling=rolling)
    frame = _of_trainings(metrics)
    lap = pl.col("seconds").filter(pl.col("progress_share") >= FULL)
    parts = []
    for phase in ("training", "evaluation"):
        grouped = frame.filter(pl.col("phase") == phase).group_by("round", "iteration").agg(
            pl.len().alias(f"{phase}_episodes"),
            *(getattr(pl.col(name), method)().alias(f"{phase}_{name}")
              for name in ("progress_share", "reward", "seconds")),
            (pl.col("progress_share") >= FULL).mean().alias(f"{phase}_complete_share"),
            getattr(lap, method)().alias(f"{phase}_lap_seconds"),
            lap.min().alias(f"{phase}_best_lap_seconds"),
        )  # fmt: skip
        parts.append(grouped)
    table = parts[0].join(parts[1], on=["round", "iteration"], how="full", coalesce=True).sort("round", "iteration")
    table = table.with_row_index("master_iteration").select(
        "round", "iteration", "master_iteration", pl.exclude("round", "iteration", "master_iteration")
    )
    if rolling == 1:
        return table
    smooth = [name for name in table.columns if name.endswith(("_share", "_reward", "_seconds"))]
    return table.with_columns(pl.col(smooth).rolling_mean(rolling, min_samples=1).over("round"))


def completion_progress(metrics: pl.DataFrame | pl.LazyFrame, method: str = "mean", rolling: int = 5) -> Plot:
    """Return how completion went over the iterations, training and evaluation: `metrics_summary`; smoothed.

    Raises:
        PlotError: As `metrics_summary`.
    """
    data, smooth = metrics_summary(metrics, method), metrics_summary(metrics, method, rolling)
    title = f"Completion, {method} of each iteration"
    columns = [f"{phase}_progress_share" for phase in ("training", "evaluation")]
    return Plot("completion_progress", title, data, lambda: _draw(data, smooth, columns, title, "% of a lap", 100.0))


def lap_time_progress(metrics: pl.DataFrame | pl.LazyFrame, method: str = "mean", rolling: int = 5) -> Plot:
    """Return how the times of full laps went over the iterations: `metrics_summary`.

    Raises:
        PlotError: There is no full lap; else as `metrics_summary`.
    """
    data, smooth = metrics_summary(metrics, method), metrics_summary(metrics, method, rolling)
    columns = [f"{phase}_lap_seconds" for phase in ("training", "evaluation")]
    if all(data[name].null_count() == data.height for name in columns):
        raise PlotError("There is no full lap here; expected one at least. Let the training go on.")
    title = f"Time of full laps, {method} of each iteration"
    return Plot("lap_time_progress", title, data, lambda: _draw(data, smooth, columns, title, "s", 1.0))


def metrics_best_laps(metrics: pl.DataFrame | pl.LazyFrame, count: int = 10) -> pl.DataFrame:
    """Return the fastest full laps: `round`, `phase`, `worker`, `iteration`, `episode`, `seconds`, `reward`."""
    import polars as pl

    full = _rows(metrics, "progress_share", "seconds").filter(pl.col("progress_share") >= FULL)
    return (
        full.sort("seconds").head(count).select("round", "phase", "worker", "iteration", "episode", "seconds", "reward")
    )


def lap_scatter(metrics: pl.DataFrame | pl.LazyFrame) -> Plot:
    """Return every episode as a dot: how far it came and how long it took, the full laps by iteration.

    Raises:
        PlotError: There are no metrics.
    """
    data = _of_trainings(metrics)
    return Plot("lap_scatter", "Every episode of the metrics", data, lambda: _draw_dots(data))


def _of_trainings(metrics: pl.DataFrame | pl.LazyFrame) -> pl.DataFrame:
    """Return the rows of trainings, with the evaluations that stand between their iterations."""
    import polars as pl

    frame = _rows(metrics, "round", "phase", "stream", "iteration", "progress_share", "seconds", "reward")
    frame = frame.filter(pl.col("stream") == "")
    if not frame.height:
        raise PlotError(NO_METRICS)
    return frame


def _rows(metrics: pl.DataFrame | pl.LazyFrame, *columns: str) -> pl.DataFrame:
    """Return the metrics, as `require` does; of logs without a metrics file it is said which file there should be."""
    frame = metrics.lazy().collect()
    if not frame.height:
        raise PlotError(NO_METRICS)
    return require(frame, *columns)


def _draw(data: pl.DataFrame, smooth: pl.DataFrame, columns: list[str], title: str, unit: str, scale: float) -> Any:
    figure, (axes,) = sheet(1, 1, [title], (8.0, 3.2))
    at = values(data, "master_iteration")[0]
    for name, colour, mark in zip(columns, (ORANGE, BLUE), ("o", "s"), strict=True):
        dots, line = (scale * values(one, name)[0] for one in (data, smooth))
        if np.isfinite(dots).any():
            axes.plot(at, dots, mark, color=colour, ms=3, alpha=0.5)
            axes.plot(at, line, color=colour, lw=1.8, label=name.split("_")[0])
    _mark_rounds(axes, data)
    axes.legend(frameon=False, fontsize=9)
    name_axes(axes, "iteration, all rounds", unit)
    return figure


def _mark_rounds(axes: Any, data: pl.DataFrame) -> None:
    """Draw a line where a round begins."""
    rounds, at = values(data, "round", "master_iteration")
    for k in np.flatnonzero(np.diff(rounds)):
        axes.axvline(at[k + 1] - 0.5, color="#6b7680", lw=0.8, ls=":")


def _draw_dots(data: pl.DataFrame) -> Any:
    figure, axes = sheet(1, 2, ["Progress and time of each episode", "Full laps"], (5.0, 3.2))
    for k, phase in enumerate(("training", "evaluation")):
        rows = data.filter(data["phase"] == phase)
        share, seconds = values(few(rows), "progress_share", "seconds")
        axes[0].scatter(100 * share, seconds, s=6, color=CYCLE[1 - k], marker="os"[k], alpha=0.5, lw=0, label=phase)
        full = rows.filter(rows["progress_share"] >= FULL)
        axes[1].scatter(*values(few(full), "iteration", "seconds"), s=9, color=CYCLE[1 - k], marker="os"[k], lw=0)
    axes[0].legend(frameon=False, fontsize=9)
    name_axes(axes[0], "% of a lap", "s")
    name_axes(axes[1], "iteration", "s")
    return figure
