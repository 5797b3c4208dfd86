"""What a car's run suggests to try next, from its metrics and its log together. Begin with `car_advice`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.analysis.advice import Advice
from racecraft.analysis.custom_plots import NoPlot, made_or_why
from racecraft.analysis.learner import Learner
from racecraft.analysis.plot import Plot
from racecraft.analysis.run_advice import TRAIN, typed
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.logs import own_plots, track_or_none
from racecraft.worlds.deepracer.analysis.logs.advice import advice
from racecraft.worlds.deepracer.analysis.logs.judged import judged_in_run
from racecraft.worlds.deepracer.logs import read
from racecraft.worlds.deepracer.logs.errors import LogError

if TYPE_CHECKING:
    import polars as pl

    from racecraft.worlds.deepracer.tracks.track import Track

OWN = " my-car"
"""The folder in commands of advice that ask for another reward or other actions; the run's own takes its place."""
MAX_TICKS = 500_000
"""Ticks that advice goes by; of a longer run the latest."""


def car_advice(run: RunFolder, learner: Learner, found: list[Advice]) -> list[Advice]:
    """Return what the learner's figures suggest together with what the log does."""
    log = _log_of(run)
    return found if log is None else merge_advice(found, advice(*log, learner, judged_in_run(run.read_metrics())))


BACK, ON = "--from RUN:best", "--run RUN --resume"


def merge_advice(learners: list[Advice], logs: list[Advice]) -> list[Advice]:
    """Return both sides' advice, without a log's to go on from the last checkpoint where the learner would go back.

    Evaluations that fell while exploring drives rose tell both, and only one can be followed.
    """
    goes_back = any(BACK in one.command for one in learners)
    return learners + [one for one in logs if not (goes_back and ON in one.command)]


def as_typed(command: str, job: Mapping[str, Any]) -> str:
    r"""Return a command of advice as it is typed for a car's run; where it needs files of one's own, how to make them.

    >>> as_typed("racecraft train my-car --from RUN:best", {"asked": {"track": "Oval_track"}})
    'racecraft new my-car\nracecraft train my-car --track Oval_track --from RUN:best'
    """
    request = job.get("asked", {})
    folder, first = request.get("folder"), ""
    if command.startswith(TRAIN + OWN):
        command = command.replace(OWN, "", 1)
        if not folder and ON not in command:
            folder, first = OWN.strip(), f"racecraft new{OWN}\n"
    track = ["--track", request["track"]] if request.get("track") else []
    return first + typed(command, TRAIN, job, [*([folder] if folder else []), *track])


def custom_plots_of(run: RunFolder, files: Sequence[Path]) -> list[Plot | NoPlot]:
    """Return the racer's own plots of a run's training, or why they failed; none where it has no log yet.

    Raises:
        CustomPlotError: A file holds no plot.
    """
    makers = own_plots(files)
    log = _log_of(run) if makers else None
    return [] if log is None else made_or_why(makers, *log)


def _log_of(run: RunFolder) -> tuple[pl.DataFrame, Track | None] | None:
    """Return the training's ticks and the circuit; None before there is a log."""
    try:
        logs = read(run.path)
        ticks = logs.training.collect().tail(MAX_TICKS)
    except LogError:
        return None
    own = str(run.track) if run.track.is_file() else None  # a track of the racer's own travels with the run
    return (ticks, track_or_none(ticks, own or logs.about.get("world"))) if ticks.height else None
