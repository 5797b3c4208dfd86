"""What a run suggests to try next, from its metrics and its log together. Begin with `advice_of`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.analysis.deepracer.logs import own_plots, track_or_none
from racecraft.analysis.deepracer.logs.advice import Advice, advice
from racecraft.analysis.deepracer.logs.plot import Plot
from racecraft.analysis.learning_advice import learning_advice
from racecraft.formats.run_folder import RunFolder
from racecraft.logs import read
from racecraft.logs.errors import LogError

if TYPE_CHECKING:
    import polars as pl

    from racecraft.tracks.track import Track

KIND = "deepracer"
WHOLE_LAP = 100.0
"""The best score of a car, per cent of a lap."""
MOST_TICKS = 500_000
"""Ticks that advice goes by; of a longer run the latest."""


def advice_of(run: RunFolder) -> list[Advice]:
    """Return what a run suggests, the learner's side first; nothing where there is too little to go by."""
    is_car = run.read_job().get("kind") == KIND
    found = learning_advice(run.read_metrics(), WHOLE_LAP if is_car else None)
    if not is_car:
        return found
    told = _log_of(run)
    return found if told is None else found + advice(*told)


def own_plots_of(run: RunFolder, files: Sequence[Path]) -> list[Plot]:
    """Return the racer's own plots of a run's training; none where it has no log yet.

    Raises:
        OwnPlotError: A file holds no plot, or one does not work.
    """
    makers = own_plots(files)
    told = _log_of(run) if makers else None
    return [] if told is None else [make(*told) for make in makers]


def _log_of(run: RunFolder) -> tuple[pl.DataFrame, Track | None] | None:
    """Return the training's ticks and the circuit; None before there is a log."""
    try:
        logs = read(run.path)
        ticks = logs.training.collect().tail(MOST_TICKS)
    except LogError:
        return None
    own = str(run.track) if run.track.is_file() else None  # a track of the racer's own travels with the run
    return (ticks, track_or_none(ticks, own or logs.about.get("world"))) if ticks.height else None
