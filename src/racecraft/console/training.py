"""Begin and end the training of a model, as a job of racecraft's own commands. Begin with `begin_training`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from racecraft.console.workspace import Model
from racecraft.console.workspace_settings import read_settings
from racecraft.formats.job_spec import JobSpec
from racecraft.formats.run_folder import RunFolder
from racecraft.isolation.layers import can_isolate
from racecraft.jobs.job import Job
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.states import JobError
from racecraft.jobs.submit import environment_here, request_stop, submit_numbered, wait

MAX_OPEN = 4
"""Trainings of one racer that run or wait; AWS's console had as many."""
STOP_SECONDS = 60.0
"""So long a training may take to end its iteration where another one of its model is to begin."""


@dataclass(frozen=True)
class Command:
    """A command of racecraft's, and the folder it is typed in."""

    words: tuple[str, ...]
    folder: str

    def __str__(self) -> str:
        import shlex

        return f"cd {shlex.quote(self.folder)}\nracecraft {shlex.join(self.words)}"


def training_command(model: Model, words: Sequence[str]) -> Command:
    """Return the command that trains a model.

    Args:
        model: Which one; the command is typed in its folder.
        words: Behind `racecraft`, without --run.
    """
    return Command((*words, f"--run={model.next_run()}"), str(model.path))


def begin_training(home: JobPaths, model: Model, words: Sequence[str]) -> Job:
    """Put a training of a model into the queue.

    Args:
        home: Where the jobs of this account are.
        model: Which one.
        words: Behind `racecraft`, without --run.

    Raises:
        JobError, DatabaseError: As `racecraft.jobs.submit.submit`.
        InputFileError: The workspace's settings cannot be read.
        JobError: A racer has MAX_OPEN trainings already, or this machine cannot confine a racer's reward function.
    """
    if home.person:
        _require_guest(home)
    told = read_settings(model.path.parent.parent).words()
    command = training_command(model, (*words, *told))
    run = command.words[-1].partition("=")[2]
    verb = [word for word in words[:2] if re.fullmatch(r"[a-z]+", word)]
    resume = (*verb, f"--run={run}", "--resume", *told, *(word for word in words if word.startswith("--stop=")))

    def spec(name: str) -> JobSpec:
        return JobSpec(
            command=command.words,
            name=name,
            resume=resume,
            run=run,
            folder=command.folder,
            environment=environment_here(),
        )

    return submit_numbered(home, job_name(model.name), spec)


def _require_guest(home: JobPaths) -> None:
    """Refuse what somebody who was invited may not begin on this machine."""
    if not can_isolate():
        raise JobError(
            "This system cannot confine a reward function (docs/security.md); expected Linux 5.13 or newer. "
            "Only the owner trains here."
        )
    waiting = len(home.store().open_jobs())
    if waiting >= MAX_OPEN:
        raise JobError(
            "You have {count} trainings that run or wait; expected fewer than {most}. Stop one first.",
            count=waiting, most=MAX_OPEN,
        )  # fmt: skip


def stop_training(home: JobPaths, model: Model, job: str) -> None:
    """Ask a training to end after its iteration; what it has learned stays.

    Args:
        home: Where the jobs of this account are.
        model: Which one.
        job: The job that trains it; "": a command of somebody's does.

    Raises:
        UserInputError: There is no such job, or the folder cannot be written.
    """
    if job:
        request_stop(home, home.store(), job)
    elif runs := model.runs():
        RunFolder(runs[-1]).request_stop()


def end_training(home: JobPaths, model: Model, job: str) -> None:
    """End a training and wait until its last checkpoint is written; arguments as of `stop_training`.

    Raises:
        JobError: It has not ended after STOP_SECONDS.
        UserInputError: As from `stop_training`.
    """
    stop_training(home, model, job)
    if job:
        wait(home, home.store(), job, STOP_SECONDS)


def job_name(model: str) -> str:
    """Return the beginning of a job's name, which has letters, digits and - alone.

    >>> job_name("mint_7 (fast)"), job_name("ミント")
    ('mint-7-fast', 'model')
    """
    return re.sub(r"[^A-Za-z0-9]+", "-", model).strip("-")[:48].strip("-") or "model"
