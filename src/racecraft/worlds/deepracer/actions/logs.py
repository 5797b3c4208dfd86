"""What a log tells: as figures, on a page, as a table."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    import polars as pl

    from racecraft.analysis.advice import Advice
    from racecraft.worlds.deepracer.logs import Logs
    from racecraft.worlds.deepracer.tracks.track import Track


MAX_SHOWN_DAMAGE = 10


@dataclass(frozen=True, kw_only=True)
class LogsRequest(Request):
    """Which logs are read, and what is written."""

    paths: tuple[Path, ...] = argument(
        "Run folder, DeepRacer model or log folder, .tar.gz, log, trace or metrics; several: rounds."
    )
    page: Path | None = option(
        None,
        "Write one interactive page (.html) that works offline; of several models one each, their names behind its.",
    )
    csv: Path | None = option(None, "Write every step into this CSV file.")
    parquet: Path | None = option(None, "Write every step into this Parquet file.")
    track: str | None = option(None, "The track it was driven on, or its waypoint file; by default it is found.")
    phase: str | None = option(None, "training, evaluation or leaderboard, where a loose file does not tell.")
    reward: Path | None = option(None, "On the page: what this reward_function.py would have paid for the same laps.")
    plots: tuple[Path, ...] = option((), "On the page: your own plots, a Python file or a folder of them.")


@action
def logs(request: LogsRequest, progress: Progress = quiet) -> Figures:
    """Tell what a log holds, whoever wrote it, and what to change before the next training.

    Damaged rows are named with file and line and passed over.

    Examples:

        racecraft logs my-model --page my-model.html

        racecraft logs deepracer-downloads/model.tar.gz --json

        racecraft logs round-1 round-2 --parquet both.parquet

        racecraft logs my-model --page my-model.html --reward new_reward.py --plots my_plots.py
    """
    from racecraft.worlds.deepracer.logs import read

    found = read(request.paths, request.phase)
    ticks = found.ticks.collect()
    if not ticks.height and not found.metrics.collect().height:
        found.require_ticks()
    models = _models(found, ticks, request.track)
    alone = models[0] if len(models) == 1 else None
    facts = _facts(found, ticks, alone.circuit if alone else None) | {
        "advice": [
            {"found": one.found, "try": one.try_, "model": model.name} for model in models for one in model.advice
        ],
    }
    for damage in found.damaged[:MAX_SHOWN_DAMAGE]:
        progress(str(damage))
    if len(found.damaged) > MAX_SHOWN_DAMAGE:
        progress(f"and {len(found.damaged) - MAX_SHOWN_DAMAGE} more; --json names them all")
    if request.page is None and (request.reward is not None or request.plots):
        raise SettingError("--reward and --plots are of the page; expected --page with them, such as --page logs.html.")
    files = {} if request.page is None or len(models) > 1 else {"page": _page(request, request.page, found, alone)}
    facts["models"] = _pages(request, found, models) if len(models) > 1 else [one.as_dictionary() for one in models]
    return Figures(facts, files | _written(found, request.csv, request.parquet))


@dataclass(frozen=True)
class _Model:
    """What the logs of one model tell."""

    name: str
    """Its folder below the one that was named; "" where there is but one."""
    root: str
    """The same, as `Logs.models` calls it."""
    rounds: tuple[int, ...]
    ticks: pl.DataFrame
    """Numbered as all logs are together; with the places along the circuit where there is one."""
    circuit: Track | None
    advice: Sequence[Advice]

    def as_dictionary(self) -> dict[str, Any]:
        track = None if self.circuit is None else self.circuit.name
        return {"model": self.name, "rounds": list(self.rounds), "track": track}


def _models(found: Logs, ticks: pl.DataFrame, track: str | None) -> list[_Model]:
    """Return the models whose ticks the logs tell, each with its own track and advice."""
    from racecraft.worlds.deepracer.analysis.logs import on_track

    models = []
    for root, rounds in found.models().items():
        own = ticks.filter(ticks["round"].is_in(rounds))
        if own.height:
            about = found.about_rounds(rounds)
            circuit = _circuit(own, track, about.get("world"))
            own = on_track(own, circuit) if circuit is not None else own
            tried = _advice(found, own, circuit, about)
            models.append(_Model(root.strip("/") or ".", root, rounds, own, circuit, tried))
    return [replace(models[0], name="")] if len(models) == 1 else models


def _circuit(ticks: pl.DataFrame, track: str | None, world: str | None) -> Track | None:
    from racecraft.worlds.deepracer.analysis.logs import find_track, track_or_none

    return find_track(ticks, track) if track is not None else track_or_none(ticks, world)


def _facts(found: Logs, ticks: pl.DataFrame, circuit: Track | None) -> dict[str, Any]:
    """Return everything that is told, by name; shares from 0 to 1, times in seconds."""
    facts: dict[str, Any] = {
        "files": len(found.files),
        "ticks": ticks.height,
        "track": circuit.name if circuit is not None else None,
        "reversed": circuit.is_reversed if circuit is not None else None,
        "damaged": [{"file": one.file, "line": one.line, "what": one.what} for one in found.damaged],
        "phases": [],
    }
    if not ticks.height:
        return facts | {"metrics": _metrics(found)}
    facts["phases"] = _phases(ticks)
    return facts


def _advice(found: Logs, ticks: pl.DataFrame, circuit: Track | None, about: dict[str, Any]) -> list[Advice]:
    """Return what to change before the next training; nothing where no training is told of."""
    import polars as pl

    from racecraft.analysis.learner import learner_of_log
    from racecraft.worlds.deepracer.analysis.logs.advice import advice
    from racecraft.worlds.deepracer.analysis.logs.judged import judged_in_log

    training = ticks.filter(pl.col("phase") == "training")
    if not training.height:
        return []
    metrics = found.metrics.collect()
    judged = judged_in_log(ticks, metrics.filter(metrics["round"].is_in(ticks["round"].unique().implode())))
    return advice(training, circuit, learner_of_log(about), judged)


def _phases(ticks: pl.DataFrame) -> list[dict[str, Any]]:
    import polars as pl

    from racecraft.worlds.deepracer.analysis.logs import simulation_agg

    full = pl.col("complete")
    table = simulation_agg(ticks).group_by("round", "phase", "stream", maintain_order=True).agg(
        pl.col("worker").n_unique().alias("workers"), pl.col("iteration").n_unique().alias("iterations"),
        pl.len().alias("episodes"), pl.col("steps").sum(), full.sum().alias("full_laps"),
        pl.col("seconds").filter(full).min().alias("best_lap_seconds"),
        pl.col("progress_share").mean().alias("mean_progress_share"), pl.col("reward").mean().alias("mean_reward"),
    )  # fmt: skip
    return table.with_columns(pl.col("phase").cast(pl.String)).to_dicts()


def _metrics(found: Logs) -> list[dict[str, Any]]:
    import polars as pl

    done = pl.col("status") == "lap_complete"
    table = found.metrics.group_by("round", "phase", "stream", maintain_order=True).agg(
        pl.len().alias("episodes"), pl.col("iteration").n_unique().alias("iterations"),
        (pl.col("progress_share") >= 1).sum().alias("full_laps"),
        pl.col("seconds").filter(done | (pl.col("progress_share") >= 1)).min().alias("best_lap_seconds"),
        pl.col("progress_share").mean().alias("mean_progress_share"), pl.col("reward").mean().alias("mean_reward"),
    )  # fmt: skip
    return table.with_columns(pl.col("phase").cast(pl.String)).collect().to_dicts()


def _pages(request: LogsRequest, found: Logs, models: Sequence[_Model]) -> list[dict[str, Any]]:
    """Return what is told of several models; where pages are asked for, each has its own, and its path is told.

    Raises:
        SettingError: Two pages would have one name.
    """
    if request.page is None:
        return [model.as_dictionary() for model in models]
    paths = [_path_of(request.page, model) for model in models]
    if twice := [str(path) for k, path in enumerate(paths) if path in paths[:k]]:
        raise SettingError(
            "--page {page}: two models would be written to {path}; expected folders whose names differ. Name one "
            "model's folder.",
            page=request.page,
            path=twice[0],
        )
    return [
        model.as_dictionary() | {"page": str(_page(request, path, found, model))}
        for path, model in zip(paths, models, strict=True)
    ]


def _path_of(page: Path, model: _Model) -> Path:
    """Return where a model's page lies: logs.html, of cars/ahead logs-cars-ahead.html."""
    return page if model.name == "." else page.with_stem(f"{page.stem}-{model.name.replace('/', '-')}")


def _page(request: LogsRequest, path: Path, found: Logs, model: _Model | None) -> Path:
    """Write the page of a model's logs; None: of metrics files alone. Return its path."""
    from racecraft.worlds.deepracer.analysis.logs import own_plots
    from racecraft.worlds.deepracer.analysis.logs.page import Extras, write_logs_page
    from racecraft.worlds.deepracer.env.reward_process import open_reward

    named = ", ".join(one.resolve().name for one in request.paths)
    own = found.of_model(model.root) if model is not None else found
    metrics = own.metrics.collect()
    if model is None and metrics.height:
        return _metrics_page(request, path, found, metrics, named)
    ticks = own.require_ticks()
    assert model is not None  # there are ticks
    ticks = model.ticks if own is found else ticks
    title = named if model.name in ("", ".") else model.name
    extras = Extras(
        damaged=tuple(str(damage) for damage in own.damaged),
        metrics=metrics if metrics.height else None,
        reward=None if request.reward is None else open_reward(request.reward, sys.stderr).call,
        plots=own_plots(request.plots),
        advice=model.advice,
    )
    return Path(write_logs_page(path, ticks, model.circuit, title, extras))


def _metrics_page(request: LogsRequest, path: Path, found: Logs, metrics: pl.DataFrame, title: str) -> Path:
    """Write the page of metrics files alone.

    Raises:
        LogError: Something is to stand on it that needs steps.
    """
    from racecraft.worlds.deepracer.analysis.logs.metrics_page import write_metrics_page

    if request.reward is not None or request.plots:
        found.require_ticks()
    return write_metrics_page(path, metrics, title, [str(damage) for damage in found.damaged])


def _written(found: Logs, csv: Path | None, parquet: Path | None) -> dict[str, Any]:
    """Write the tables that were asked for; return where they lie."""
    from racecraft.worlds.deepracer.logs.tick_export import write_csv, write_parquet

    written: dict[str, Any] = {}
    if csv is not None:
        written["csv"] = str(write_csv(csv, found.require_ticks()))
    if parquet is not None:
        written["parquet"] = str(write_parquet(parquet, found.require_ticks()))
    return written
