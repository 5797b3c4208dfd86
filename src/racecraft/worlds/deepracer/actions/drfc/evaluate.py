"""Evaluations of a DeepRacer-for-Cloud folder: begin, run, stop."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import argument, option
from racecraft.worlds.deepracer.actions.drfc.installation import InstallationRequest
from racecraft.worlds.deepracer.actions.drfc.jobs import (
    StartedJob,
    StoppedJobs,
    begin_job,
    log_of,
    refuse_if_busy,
    stop_latest,
    trained_model,
)
from racecraft.worlds.deepracer.actions.drfc.sync import place_of_model, send
from racecraft.worlds.deepracer.actions.evaluate import EvaluatedDrive, evaluate
from racecraft.worlds.deepracer.actions.race import Raced

CLONE_END = "-E"
"""What a clone to be judged is called after its model, as at DeepRacer for Cloud."""


@dataclass(frozen=True, kw_only=True)
class StartEvaluationRequest(InstallationRequest):
    """What is judged, and what is shown of it."""

    quiet: bool = option(False, "Show no log; dr-logs-robomaker -e shows it later.", "-q")
    clone: bool = option(False, "Judge a copy of the model, PREFIX-E, made anew.", "-c")


@dataclass(frozen=True, kw_only=True)
class RunEvaluationRequest(InstallationRequest):
    """Which model is judged."""

    model: Path = argument("The run folder.")


@action
def start_evaluation(request: StartEvaluationRequest, progress: Progress = quiet) -> StartedJob:
    """Judge the model of run.env in a race with resets and penalties, in the background: DR_EVAL_… says how.

    Example: racecraft dr start-evaluation -q
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import EVALUATION
    from racecraft.worlds.deepracer.files.model_copy import copy_model, wipe_model
    from racecraft.worlds.deepracer.training.race_environment import race_environment

    drfc = request.open(progress)
    model = drfc.model
    refuse_if_busy(drfc, EVALUATION, model)
    race_environment(None, clones=False, drfc=drfc)  # refuses a wrong value now
    source = trained_model(drfc)
    if request.clone:
        model = model.with_name(model.name + CLONE_END)
        wipe_model(model)
        copy_model(source, model)
        progress(f"{source.path}: copied to {model}")
    words = ("run-evaluation", str(model.absolute()))
    job = begin_job(request.installation, drfc, EVALUATION, model, words)
    sentence = f"{job.name} judges {model}; dr-stop-evaluation ends it"
    return StartedJob(job.name, model, sentence, None if request.quiet else log_of(job))


@action
def run_evaluation(request: RunEvaluationRequest, progress: Progress = quiet) -> EvaluatedDrive | Figures | Raced:
    """Judge a model in this process as run.env asks; dr-start-evaluation has it done in the background."""
    from racecraft.worlds.deepracer.actions.drfc.opponent import race_opponent
    from racecraft.worlds.deepracer.env.settings import HEAD_TO_MODEL
    from racecraft.worlds.deepracer.training.race_rules import judging_in_drfc

    drfc, model = request.installation.open(), request.model
    rules: dict[str, Any] = judging_in_drfc(drfc.env.run)
    judged: EvaluatedDrive | Figures | Raced
    if drfc.text("DR_RACE_TYPE") == HEAD_TO_MODEL:
        judged = race_opponent(drfc, model, rules, progress)
    else:
        trials = rules.pop("laps")
        track, films = drfc.env.run.values.get("DR_WORLD_NAME"), drfc.flag("DR_EVAL_SAVE_MP4")
        judged = evaluate(model, track=[track] if track else [], number_of_trials=trials, save_mp4=films, **rules)
    if model.absolute() == drfc.model.absolute():  # a clone is this machine's own
        send(model, place_of_model(drfc), progress)
    return judged


@action
def stop_evaluation(request: InstallationRequest, progress: Progress = quiet) -> StoppedJobs:
    """Stop the evaluation of this run id.

    Example: racecraft dr stop-evaluation
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import EVALUATION

    return stop_latest(request.installation.open(), EVALUATION, "dr-start-evaluation", progress)
