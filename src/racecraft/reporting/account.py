"""What a run suggests to try next, from its metrics and its log together. Begin with `advice_of`."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.analysis.advice import Advice
from racecraft.analysis.learner import learner_of_job
from racecraft.analysis.learning_advice import learning_advice
from racecraft.analysis.own_plots import NoPlot, made_or_why
from racecraft.analysis.plot import Plot
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.logs import own_plots, track_or_none
from racecraft.worlds.deepracer.analysis.logs.advice import advice
from racecraft.worlds.deepracer.analysis.logs.judged import judged_in_run
from racecraft.worlds.deepracer.logs import read
from racecraft.worlds.deepracer.logs.errors import LogError

if TYPE_CHECKING:
    import polars as pl

    from racecraft.worlds.deepracer.tracks.track import Track

KIND = "deepracer"
TRAIN = "racecraft train"
VERBS = {"gymnasium": "racecraft gym train", "battlesnake": "racecraft snakes train", "unity": "racecraft unity train"}
"""How a training of each kind is typed; a car's is TRAIN."""
OWN = " my-car"
"""The folder in commands of advice that ask for another reward or other actions; the run's own takes its place."""
USUAL = "ppo"
"""The algorithm of a training that asks for none."""
WHOLE_LAP = 100.0
"""The best score of a car, per cent of a lap."""
MOST_TICKS = 500_000
"""Ticks that advice goes by; of a longer run the latest."""


def advice_of(run: RunFolder) -> list[Advice]:
    """Return what a run suggests, the learner's side first; nothing where there is too little to go by."""
    job = run.read_job()
    is_car = job.get("kind") == KIND
    learner = learner_of_job(job)
    metrics = run.read_metrics()
    found = learning_advice(metrics, learner, WHOLE_LAP if is_car else None)
    told = _log_of(run) if is_car else None
    if told is not None:
        found = of_one_mind(found, advice(*told, learner, judged_in_run(metrics)))
    return [replace(one, command=as_asked(one.command, job)) for one in found]


BACK, ON = "--from RUN:best", "--run RUN --resume"


def of_one_mind(learners: list[Advice], logs: list[Advice]) -> list[Advice]:
    """Return both sides' advice, without a log's to go on from the last checkpoint where the learner would go back.

    Evaluations that fell while exploring drives rose tell both, and only one can be followed.
    """
    goes_back = any(BACK in one.command for one in learners)
    return learners + [one for one in logs if not (goes_back and ON in one.command)]


def as_asked(command: str, job: Mapping[str, Any]) -> str:
    """Return a command as this run's training is typed: its world's verb, what it was asked to train on, and by what.

    >>> as_asked("racecraft train --from RUN:best", {"kind": "gymnasium", "asked": {"environment": "CartPole-v1"}})
    'racecraft gym train CartPole-v1 --from RUN:best'
    """
    kind, asked = str(job.get("kind")), job.get("asked", {})
    verb = VERBS.get(kind, TRAIN)
    if command.split()[:2] != TRAIN.split():
        return command
    rest = command.removeprefix(TRAIN).removeprefix(OWN)
    if "--run RUN" in rest:
        return f"{verb}{rest}"  # who goes on is asked nothing anew
    if kind == KIND and rest != command.removeprefix(TRAIN) and not asked.get("folder"):
        asked, first = {**asked, "folder": OWN.strip()}, f"racecraft new{OWN}\n"  # there are no files yet to change
    else:
        first = ""
    return first + " ".join([verb, *_subject(kind, asked), *_algorithm(job)]) + rest


def _algorithm(job: Mapping[str, Any]) -> list[str]:
    """Return the words that ask for the run's algorithm; none where it is the usual one."""
    name = str(job.get("algorithm", USUAL))
    return [] if name == USUAL else ["--algorithm", shlex.quote(name)]


def _subject(kind: str, asked: Mapping[str, Any]) -> list[str]:
    """Return the words that say what is trained on, quoted for a shell."""
    if kind == KIND:
        track = ["--track", asked["track"]] if asked.get("track") else []
        words = [*([asked["folder"]] if asked.get("folder") else []), *track]
    elif kind == "battlesnake":
        game = asked.get("game", {})
        told = {"-W": "width", "-H": "height", "--snakes": "players", "-g": "ruleset", "-m": "map"}
        words = [word for flag, name in told.items() if name in game for word in (flag, game[name])]
    else:
        words = [asked[name] for name in ("environment", "build") if asked.get(name)]
    return [shlex.quote(str(word)) for word in words]


def own_plots_of(run: RunFolder, files: Sequence[Path]) -> list[Plot | NoPlot]:
    """Return the racer's own plots of a run's training, or why they failed; none where it has no log yet.

    Raises:
        OwnPlotError: A file holds no plot.
    """
    makers = own_plots(files)
    told = _log_of(run) if makers else None
    return [] if told is None else made_or_why(makers, *told)


def _log_of(run: RunFolder) -> tuple[pl.DataFrame, Track | None] | None:
    """Return the training's ticks and the circuit; None before there is a log."""
    try:
        logs = read(run.path)
        ticks = logs.training.collect().tail(MOST_TICKS)
    except LogError:
        return None
    own = str(run.track) if run.track.is_file() else None  # a track of the racer's own travels with the run
    return (ticks, track_or_none(ticks, own or logs.about.get("world"))) if ticks.height else None
