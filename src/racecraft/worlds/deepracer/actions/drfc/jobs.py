"""The jobs of a DeepRacer-for-Cloud folder: one training, evaluation and viewer for each run id."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import Served
from racecraft.actions.jobs import report_lines
from racecraft.contract.errors import UserInputError
from racecraft.contract.message import Message
from racecraft.contract.progress import Progress
from racecraft.worlds.deepracer.actions.drfc.installation import Installation
from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder
from racecraft.worlds.deepracer.files.run_env_variables import BY_NAME

if TYPE_CHECKING:
    from racecraft.formats.run_folder import RunFolder
    from racecraft.jobs.job import Job
    from racecraft.worlds.deepracer.files.drfc_jobs import RecordedJob


class NothingToDoError(UserInputError):
    """What a command is to act on is not there."""


@dataclass(frozen=True)
class StartedJob(Served):
    """A job of an installation; serving it reports its log until it has ended."""

    job: str
    model: Path
    sentence: str
    """What it does, for people."""
    log: Path | None = None
    """None: no log is reported."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return job, model and log."""
        return {"job": self.job, "model": self.model, "log": self.log}

    def serve(self, ready: Callable[[], None], progress: Progress) -> None:
        """Report each line of the log as it is written; Ctrl-C ends the reports and not the job."""
        ready()
        if self.log is not None:
            report_job(self.job, self.log, progress)


@dataclass(frozen=True)
class StoppedJobs:
    """Jobs of an installation that were asked to end, each with its state."""

    run_id: int
    states: dict[str, str]
    model: str = ""
    """The run folder of the training that was stopped."""


def report_job(job: str, log: Path, progress: Progress) -> None:
    """Report the lines of a job's log, or of a file that it writes, until the job has ended."""
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.store import get

    store = JobPaths.of_user().store()
    report_lines(log, lambda: get(store, job).ended, job, progress)


def log_of(job: Job) -> Path:
    """Return the log of a job."""
    from racecraft.jobs.job_paths import JobPaths

    return JobPaths.of_user().log(job.name)


def trained_model(drfc: DrfcFolder) -> RunFolder:
    """Return the model of DR_LOCAL_S3_MODEL_PREFIX.

    Raises:
        RunEnvError: Nothing was trained there yet.
        RunFolderError: Something else stands there, or the model is damaged.
    """
    from racecraft.formats.run_folder import RunFolder

    if not drfc.model.exists():
        raise drfc.error_at(
            "DR_LOCAL_S3_MODEL_PREFIX", "a model that was trained", "dr-start-training trains it.",
            found=Message("{model} holds no model yet", model=drfc.model),
        )  # fmt: skip
    return RunFolder.open(drfc.model)


def latest_job(drfc: DrfcFolder, kind: str) -> Job | None:
    """Return the latest training or evaluation of this run id; None where none was begun or it was forgotten."""
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.worlds.deepracer.files.drfc_jobs import job_of

    noted = job_of(drfc.path, drfc.run_id, kind)
    return None if noted is None else JobPaths.of_user().store().find(noted.job)


def require_job(drfc: DrfcFolder, kind: str, begins: str) -> Job:
    """Return the latest job of this run id.

    Args:
        drfc: The installation.
        kind: TRAINING or EVALUATION.
        begins: The command that begins one.

    Raises:
        NothingToDoError: There is none.
    """
    job = latest_job(drfc, kind)
    if job is None:
        raise NothingToDoError(
            "{path}: no {kind} of run id {run_id} is known; expected one that {begins} has begun.",
            path=drfc.path,
            kind=kind,
            run_id=drfc.run_id,
            begins=begins,
        )
    return job


def refuse_if_busy(drfc: DrfcFolder, kind: str, model: Path) -> None:
    """Refuse to begin what is under way already, and to train into a folder that another one works on.

    A training and an evaluation of one run id go side by side: that is what racers look at their model with meanwhile.

    Args:
        drfc: The installation.
        kind: What is to be begun, TRAINING or EVALUATION.
        model: The run folder that it is about.

    Raises:
        UserInputError: It is.
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.worlds.deepracer.files.drfc_jobs import EVALUATION, job_of

    job = latest_job(drfc, kind)
    if job is not None and not job.ended:
        raise UserInputError(_under_way(drfc, job, kind))
    if kind == EVALUATION:
        return
    judged = job_of(drfc.path, drfc.run_id, EVALUATION)
    judging = latest_job(drfc, EVALUATION)
    if judging is not None and judged is not None and not judging.ended and _same(Path(judged.run), model):
        raise UserInputError(_under_way(drfc, judging, EVALUATION))
    for job in JobPaths.of_user().store().jobs():
        run = job.spec.run_folder()
        if not job.ended and run is not None and _same(run, model):
            raise UserInputError(
                "{model}: job {name} trains there; expected a prefix of its own for each run id. "
                "Give another DR_LOCAL_S3_MODEL_PREFIX.",
                model=model,
                name=job.name,
            )


def _under_way(drfc: DrfcFolder, job: Job, kind: str) -> str:
    """Return the error about a job that has not ended."""
    what = "a training is" if kind == "training" else "an evaluation is"
    text = ", ".join(filter(None, (job.name, job.spec.run)))
    return (
        f"run id {drfc.run_id}: {what} under way ({text}); expected none. "
        f"dr-stop-{kind} ends it; another DR_RUN_ID and DR_LOCAL_S3_MODEL_PREFIX run beside it."
    )


def _same(one: Path, other: Path) -> bool:
    return one.resolve() == other.resolve()


def begin_job(
    installation: Installation,
    drfc: DrfcFolder,
    kind: str,
    model: Path,
    words: tuple[str, ...],
    resume: tuple[str, ...] = (),
) -> Job:
    """Put a command about a model into the background and note it under this run id.

    Several run ids are at work at once, as many as the racer begins: such a job counts no cores of the machine.

    Args:
        installation: As it was named; the job reads the same files.
        drfc: The installation.
        kind: TRAINING or EVALUATION.
        model: The run folder it works on.
        words: What is done, behind `racecraft dr`.
        resume: What goes on with it after a crash, behind `racecraft`; none: it is begun anew.
    """
    from racecraft.formats.job_spec import JobSpec
    from racecraft.jobs.children import run_mark
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import environment_here, submit_numbered
    from racecraft.worlds.deepracer.files.drfc_jobs import TRAINING, RecordedJob, record_job

    here = drfc.path.absolute()
    config = installation.config and str(installation.config.absolute())
    options = [("--config", config), ("--experiment", installation.experiment)]
    which = [word for name, value in options if value for word in (name, value)]

    def spec(name: str) -> JobSpec:
        return JobSpec(
            command=("dr", "--folder", str(here), *which, *words),
            name=name,
            resume=resume,
            run=str(model.absolute()) if kind == TRAINING else "",
            older_run=run_mark(model) if kind == TRAINING else "",
            folder=str(here),
            environment={
                name: value
                for name, value in environment_here().items()
                if name not in BY_NAME or not BY_NAME[name].is_secret  # a job's spec is a file
            },
            cores=0,
        )

    job = submit_numbered(JobPaths.of_user(), _legal(f"{kind}-{model.name}"), spec)
    record_job(drfc.path, drfc.run_id, kind, RecordedJob(job.name, str(model)))
    return job


def await_run(drfc: DrfcFolder, kind: str, job: Job, before: RecordedJob | None, progress: Progress) -> bool:
    """Wait until a job has made its run folder: by then it has read and checked all that it was given.

    It reads alone, because to read is to import half a training, and nobody wants to wait for that twice. What it
    refuses is refused here, in its words, and no trace of it is kept.

    Args:
        drfc: The installation.
        kind: What the job was noted as.
        job: A job with a run folder.
        before: What was noted before it.
        progress: Receives messages.

    Returns:
        Whether it has begun; False: Ctrl-C ended the waiting, or the job ended before it began.

    Raises:
        UserInputError: The job refuses what it was given.
        JobError: It failed otherwise before it began.
    """
    from racecraft.jobs.children import has_begun
    from racecraft.jobs.follow import last_error
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.states import JobError, State
    from racecraft.jobs.submit import delete, wait_for_run
    from racecraft.worlds.deepracer.files.drfc_jobs import record_job

    home = JobPaths.of_user()
    store = home.store()
    try:
        now = wait_for_run(home, store, job.name)
    except KeyboardInterrupt:
        progress(f"\n{job.name} goes on by itself.")
        return False
    if now.waits:
        progress(f"{job.name} waits until other jobs leave it room; `racecraft jobs list` shows them")
    if not now.ended or has_begun(now.spec):
        return True
    if now.state is not State.FAILED:
        progress(f"{job.name}: {now.state} before it began")
        return False
    if not (message := last_error(home.log(job.name))):
        raise JobError("{name}: {reason}. Its log is {log}.", name=job.name, reason=now.reason, log=home.log(job.name))
    delete(home, store, job.name)
    if before is not None:
        record_job(drfc.path, drfc.run_id, kind, before)
    raise UserInputError(message)


def stop_job(job: Job, seconds: float = 60.0) -> Job:
    """Ask a job to end and wait until it has.

    Raises:
        JobError: It has not ended after so many seconds.
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import request_stop, wait

    home = JobPaths.of_user()
    request_stop(home, home.store(), job.name)
    return wait(home, home.store(), job.name, seconds)


def stop_latest(drfc: DrfcFolder, kind: str, begins: str, progress: Progress) -> StoppedJobs:
    """Stop the latest job of this run id.

    Args:
        drfc: The installation.
        kind: TRAINING or EVALUATION.
        begins: The command that begins one.
        progress: Receives messages.

    Raises:
        NothingToDoError: There is none.
        JobError: It does not end.
    """
    job = require_job(drfc, kind, begins)
    if job.ended:
        progress(f"{job.name}: had ended already ({job.state})")
        return StoppedJobs(drfc.run_id, {})
    job = stop_job(job)
    return StoppedJobs(drfc.run_id, {job.name: job.state.value}, job.spec.run)


def _legal(name: str) -> str:
    """Return a job's name made of any text.

    >>> _legal("training-my model/v2")
    'training-my-model-v2'
    """
    letters = "".join(letter if letter.isascii() and letter.isalnum() else "-" for letter in name)
    return "-".join(filter(None, letters.split("-")))[:50].strip("-")
