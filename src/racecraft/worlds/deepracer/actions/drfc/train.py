"""Trainings of a DeepRacer-for-Cloud folder: begin, go on with the next, stop. Begin with `start_training`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.actions.mirroring import mirrored
from racecraft.contract.errors import UserInputError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import option
from racecraft.worlds.deepracer.actions.drfc.installation import InstallationRequest
from racecraft.worlds.deepracer.actions.drfc.jobs import (
    StartedJob,
    StoppedJobs,
    await_run,
    begin_job,
    latest_job,
    log_of,
    refuse_if_busy,
    stop_job,
    stop_latest,
    trained_model,
)
from racecraft.worlds.deepracer.actions.drfc.logs import simulator_log
from racecraft.worlds.deepracer.actions.drfc.sync import fetch_for_training, place_of_model, require_free
from racecraft.worlds.deepracer.actions.drfc.training import (
    require_free_model,
    require_trainable,
    training_request,
    wipe_run,
)
from racecraft.worlds.deepracer.actions.drfc.viewer import begin_viewer
from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder


@dataclass(frozen=True, kw_only=True)
class RunTrainingRequest(InstallationRequest):
    """Which training, and what of an older one stays."""

    wipe_first: bool = option(False, "Wipe the prefix first, where a model lies there already.", "-w")


@dataclass(frozen=True, kw_only=True)
class StartTrainingRequest(RunTrainingRequest):
    """Which training, and what is shown of it."""

    quiet: bool = option(False, "Show no log; dr-logs-sagemaker shows it later.", "-q")
    sagemaker: bool = option(False, "Show the log of the learner, as is done anyway.", "-s")
    robomaker: int | None = option(None, "Show the log of the simulator instead.", "-r")
    all_logs: bool = option(False, "Show all logs: there is one program, so it is one.", "-a")
    viewer: bool = option(False, "Open the viewer as well.", "-v")


@dataclass(frozen=True, kw_only=True)
class NextTrainingRequest(InstallationRequest):
    """What the next training is called."""

    force: bool = option(False, "Ask no question.", "-f")
    wipe: bool = option(False, "Wipe the next prefix, where a model lies there already.", "-w")
    prefix: str = option("", "The next prefix; by default this one, its number raised.", "-p")
    delimiter: str = option("-", "What stands before that number.", "-d")


@dataclass(frozen=True)
class TrainedModel:
    """A model whose training has ended."""

    model: Path


@dataclass(frozen=True)
class NextTraining:
    """What run.env says of the next training."""

    config: Path
    prefix: str
    pretrained_prefix: str


@action
def start_training(request: StartTrainingRequest, progress: Progress = quiet) -> StartedJob:
    """Train what run.env asks for, in the background, until dr-stop-training or RACECRAFT_STOP.

    Examples:

        racecraft dr start-training

        racecraft dr start-training -w -q
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import TRAINING, job_of

    drfc = request.open(progress)
    model = drfc.model
    words = _prepared(drfc, request.wipe_first, progress)
    again = ("train", f"--run={model.absolute()}", "--resume", "--no-pictures")
    before = job_of(drfc.path, drfc.run_id, TRAINING)
    job = begin_job(request.installation, drfc, TRAINING, model, words, again)
    if not await_run(drfc, TRAINING, job, before, progress):
        return StartedJob(job.name, model, "")
    if request.viewer:
        progress(begin_viewer(request.installation, drfc).sentence)
    shows = request.sagemaker or request.all_logs or not request.quiet
    log = simulator_log(job, request.robomaker) if request.robomaker is not None else log_of(job) if shows else None
    sentence = f"{job.name} trains run id {drfc.run_id} into {model}; dr-stop-training ends it"
    return StartedJob(job.name, model, sentence, log)


def _prepared(drfc: DrfcFolder, wipes: bool, progress: Progress) -> tuple[str, ...]:
    """Refuse what cannot be trained into, fetch what is trained with; return the job's words behind `racecraft dr`."""
    from racecraft.worlds.deepracer.files.drfc_jobs import TRAINING

    refuse_if_busy(drfc, TRAINING, drfc.model)
    place = place_of_model(drfc)
    fetch_for_training(drfc, progress)
    if not wipes:
        require_free_model(drfc)
        require_free(place)
    return ("run-training", "-w") if wipes and (drfc.model.exists() or place is not None) else ("run-training",)


@action
def run_training(request: RunTrainingRequest, progress: Progress = quiet) -> TrainedModel:
    """Train in this process what run.env asks for; dr-start-training has it done in the background."""
    from racecraft.training.callbacks import NullCallback
    from racecraft.training.worlds import carry_out, plan

    drfc = request.installation.open()
    place = place_of_model(drfc)
    training = training_request(drfc)
    planned = plan(training)
    if request.wipe_first:
        require_trainable(drfc, planned)
        wipe_run(drfc.model, place, progress)
    with mirrored(progress.training_callback() or NullCallback(), place, progress) as watching:
        carry_out(training.kind, planned, watching, progress)
    return TrainedModel(drfc.model)


@action
def increment_training(request: NextTrainingRequest, progress: Progress = quiet) -> NextTraining:
    """Write into run.env that the next training begins with the model of this one; the old file stays as run.env.bak.

    Example: racecraft dr increment-training -f
    """
    from racecraft.worlds.deepracer.files.model_copy import require_empty, wipe_model
    from racecraft.worlds.deepracer.files.run_env import edit_run_env, next_prefix

    drfc = request.installation.open()
    now = drfc.text("DR_LOCAL_S3_MODEL_PREFIX")
    trained_model(drfc)
    following = request.prefix or next_prefix(now, request.delimiter)
    target = drfc.in_bucket(following)
    if target == drfc.model:
        raise UserInputError(
            "-p {following}: is the prefix of this training already; expected another one.", following=following
        )
    if not request.force:
        progress.confirm(f"Train {following} next, beginning with {now}, and write that into {drfc.config}?")
    if request.wipe:
        wipe_model(target)
    require_empty(target)
    edit_run_env(
        drfc.config,
        {
            "DR_LOCAL_S3_PRETRAINED": "True",
            "DR_LOCAL_S3_PRETRAINED_PREFIX": now,
            "DR_LOCAL_S3_MODEL_PREFIX": following,
        },
    )
    return NextTraining(drfc.config, following, now)


@action
def stop_training(request: InstallationRequest, progress: Progress = quiet) -> StoppedJobs:
    """Stop the training of this run id: its last iteration is saved, and it can go on later.

    Example: racecraft dr stop-training
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import TRAINING

    return stop_latest(request.installation.open(), TRAINING, "dr-start-training", progress)


@action
def stop_all(request: InstallationRequest, progress: Progress = quiet) -> StoppedJobs:
    """Stop all that is at work for this run id: its training, its evaluation, its viewer.

    Example: racecraft dr stop-all
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import EVALUATION, TRAINING, VIEWER

    drfc = request.installation.open()
    found = [latest_job(drfc, kind) for kind in (TRAINING, EVALUATION, VIEWER)]
    at_work = [job for job in found if job is not None and not job.ended]
    if not at_work:
        progress(f"run id {drfc.run_id}: nothing is at work, so nothing was stopped")
    return StoppedJobs(drfc.run_id, {job.name: stop_job(job).state.value for job in at_work})
