"""Trainings that outlive the terminal they were begun in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import Served, action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.jobs.job import Job


@dataclass(frozen=True, kw_only=True)
class ListJobsRequest(Request):
    """Nothing: all are listed."""


@dataclass(frozen=True, kw_only=True)
class JobRequest(Request):
    """Which job."""

    name: str = argument("A job's name; `racecraft jobs list` has them all.", metavar="JOB")


@dataclass(frozen=True, kw_only=True)
class WaitRequest(JobRequest):
    """Which job, and how long at most."""

    seconds: float | None = option(None, "No longer than that.", low=0)


@dataclass(frozen=True, kw_only=True)
class ResumeJobRequest(JobRequest):
    """Which job goes on, until when."""

    stop: tuple[str, ...] = option((), "New stop conditions, such as minutes=10.")


@dataclass(frozen=True, kw_only=True)
class JobLogRequest(JobRequest):
    """Which job's log, and until when."""

    follow: bool = option(False, "Until the job has ended.", "--follow", "-f")


@dataclass(frozen=True)
class JobState:
    """A job as it stands."""

    job: Job

    def as_dictionary(self) -> dict[str, Any]:
        """Return what is known of the job, times in seconds."""
        return job_figures(self.job)


@dataclass(frozen=True)
class EndedJob(JobState):
    """A job that has ended, or was waited for long enough."""

    exit_code: int
    """1: it failed."""


@dataclass(frozen=True)
class ShownJob(JobState):
    """A job, and its log."""

    log: Path

    def as_dictionary(self) -> dict[str, Any]:
        """Return all that is known of the job."""
        return {**job_figures(self.job), "spec": self.job.spec.as_dictionary(), "log": self.log}


@dataclass(frozen=True)
class JobLog(Served):
    """The log of a job; serving it reports each line."""

    job: str
    log: Path
    follows: bool
    """Until the job has ended; else what it has written so far."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the job and where its log is."""
        return {"job": self.job, "log": self.log}

    def serve(self, ready: Callable[[], None], progress: Progress) -> None:
        """Report each line as it is written."""
        from racecraft.jobs.job_paths import JobPaths
        from racecraft.jobs.store import get

        ready()
        store = JobPaths.of_user().store()
        report_lines(self.log, lambda: not self.follows or get(store, self.job).ended, self.job, progress)


@dataclass(frozen=True)
class JobList:
    """All jobs, the oldest first."""

    jobs: list[Job]

    def as_dictionary(self) -> dict[str, Any]:
        """Return the jobs."""
        return {"jobs": [job_figures(job) for job in self.jobs]}


@dataclass(frozen=True)
class DeletedJob:
    """A job that was forgotten."""

    name: str


@action
def list_jobs(request: ListJobsRequest, progress: Progress = quiet) -> JobList:
    """List all jobs, the oldest first.

    Example: racecraft jobs list
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.supervisor_start import ensure_supervisor

    home = JobPaths.of_user()
    found = home.store().jobs()
    if any(not job.ended for job in found):
        ensure_supervisor(home)
    return JobList(list(found))


@action
def show_job(request: JobRequest, progress: Progress = quiet) -> ShownJob:
    """Show all that is known of a job.

    Example: racecraft jobs show gym-1
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.store import get

    home = JobPaths.of_user()
    job = get(home.store(), request.name)
    return ShownJob(job, home.log(request.name))


@action
def show_job_log(request: JobLogRequest, progress: Progress = quiet) -> JobLog:
    """Print what a job said; with --json the log goes to standard error.

    Example: racecraft jobs logs -f gym-1
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.store import get

    home = JobPaths.of_user()
    get(home.store(), request.name)
    return JobLog(request.name, home.log(request.name), request.follow)


@action
def stop_job(request: JobRequest, progress: Progress = quiet) -> JobState:
    """Ask a job to end; what it has learned until then stays, and `jobs resume` goes on from there.

    Example: racecraft jobs stop gym-1
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import request_stop

    home = JobPaths.of_user()
    return JobState(request_stop(home, home.store(), request.name))


@action
def wait_for_job(request: WaitRequest, progress: Progress = quiet) -> EndedJob:
    """Wait until a job has ended; exit code 0 where it completed or was stopped, 1 where it failed.

    Example: racecraft jobs wait gym-1 && racecraft report runs/gym-1
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import wait as wait_for

    home = JobPaths.of_user()
    job = wait_for(home, home.store(), request.name, request.seconds)
    return EndedJob(job, 1 if job.status == "Failed" else 0)


@action
def resume_job(request: ResumeJobRequest, progress: Progress = quiet) -> JobState:
    """Have a job that has ended go on from where it stands.

    Example: racecraft jobs resume gym-1 --stop minutes=10
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import resume

    home = JobPaths.of_user()
    return JobState(resume(home, home.store(), request.name, request.stop))


@action
def delete_job(request: JobRequest, progress: Progress = quiet) -> DeletedJob:
    """Forget a job that has ended, and its log; its run folder stays.

    Example: racecraft jobs delete gym-1
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import delete

    home = JobPaths.of_user()
    delete(home, home.store(), request.name)
    return DeletedJob(request.name)


def report_lines(log: Path, ended: Callable[[], bool], job: str, progress: Progress) -> None:
    """Report the lines of a log as it grows; Ctrl-C ends the reports and not the job.

    Args:
        log: Where it is written; it need not exist yet.
        ended: Tells whether nothing more will come.
        job: Whose log it is.
        progress: Receives each line.
    """
    from racecraft.jobs.follow import follow

    try:
        for text in follow(log, ended):
            progress(text.removesuffix("\n"))
    except KeyboardInterrupt:
        progress(f"\n{job} goes on by itself.")


def job_figures(job: Job) -> dict[str, Any]:
    """Return what is known of a job by name, times in seconds."""
    import time

    return {
        "name": job.name,
        "status": job.status,
        "secondary_status": job.state.value,
        "reason": job.reason,
        "command": list(job.spec.command),
        "run": str(job.spec.run_folder() or ""),
        "attempts": job.attempts,
        "created": job.created,
        "training_seconds": round(job.training_seconds(time.time()), 1),
        "transitions": [
            {"status": step.state.value, "time": step.time, "message": step.message} for step in job.transitions
        ],
    }
