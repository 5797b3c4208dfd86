"""`racecraft jobs`: trainings that outlive the terminal they were begun in."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from racecraft.actions.jobs import (
    DeletedJob,
    JobList,
    JobState,
    ShownJob,
    delete_job,
    list_jobs,
    resume_job,
    show_job,
    show_job_log,
    stop_job,
    wait_for_job,
)
from racecraft.actions.submit_job import run_job
from racecraft.cli.from_request import command
from racecraft.cli.jobs.submitted import show_submitted

WORDS = {"allow_interspersed_args": False, "ignore_unknown_options": True}
"""What follows the first word is the job's own."""

app = typer.Typer(help="Trainings that go on by themselves: run, watch, stop, resume.", no_args_is_help=True)


@app.callback()
def jobs() -> None:
    """Trainings that go on by themselves: run, watch, stop, resume."""


def _show_list(found: JobList) -> None:
    if not found.jobs:
        print("no jobs yet; `--detach` behind a training makes one")
        return
    width = max(len(job.name) for job in found.jobs)
    for job in found.jobs:
        spent = _clock(job.training_seconds(time.time()))
        print(f"{job.name:{width}}  {job.state:12}  {spent:>9}  {' '.join(job.spec.command)[:60]}")
        if job.reason and job.state not in ("Completed", "Training"):
            print(f"{'':{width}}  {job.reason}")


def _show_job(shown: ShownJob) -> None:
    job = shown.job
    print(f"{job.name}: {job.status} ({job.state}){': ' + job.reason if job.reason else ''}")
    print(f"  command  racecraft {' '.join(job.spec.command)}")
    print(f"  folder   {job.spec.folder}")
    print(f"  run      {job.spec.run or '-'}")
    print(f"  log      {shown.log}")
    times = f"{job.attempts} time{'s' * (job.attempts != 1)}"
    print(f"  started  {times}, {_clock(job.training_seconds(time.time()))} of work")
    for step in job.transitions:
        when = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(step.time))
        print(f"  {when}  {step.state:12}  {step.message}".rstrip())


def _show_state(changed: JobState) -> None:
    print(f"{changed.job.name}: {changed.job.state}")


def _show_ended(ended: JobState) -> None:
    job = ended.job
    print(f"{job.name}: {job.state}{': ' + job.reason if job.reason else ''}")


def _show_deleted(done: DeletedJob) -> None:
    print(f"{done.name}: forgotten")


app.command("run", context_settings=WORDS)(command(run_job, show_submitted))
app.command("list")(command(list_jobs, _show_list))
app.command("show")(command(show_job, _show_job))
app.command("logs")(command(show_job_log, lambda log: None))
app.command("stop")(command(stop_job, _show_state))
app.command("wait")(command(wait_for_job, _show_ended))
app.command("resume")(command(resume_job, _show_state))
app.command("delete")(command(delete_job, _show_deleted))


@app.command(hidden=True)
def enter(folder: Annotated[Path, typer.Argument(help="A job's own folder.")]) -> None:
    """Run an estimator's script in the rooms of its job; started by a supervisor."""
    from racecraft.cli.script_errors import format_script_error
    from racecraft.compat.shims import run_script
    from racecraft.sagemaker.container import entered

    with format_script_error(), entered(folder) as (script, arguments):
        run_script(script, arguments)


def _clock(seconds: float) -> str:
    """Return a time as people read it.

    >>> _clock(3725)
    '1:02:05'
    """
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{rest:02}"
