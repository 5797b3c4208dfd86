"""What a store of jobs promises. Begin with `JobStore`.

A store's duties:

- It holds jobs by name; two never have the same.
- `replace` takes a change only of the very job it holds. Of several that change one job at once, from whatever thread,
  process or machine, exactly one is told True; the others are told False and look again. Everything that must happen
  once (a supervisor takes a job) is built on that.
- What `replace` or `add` has taken is seen by every later reader, and survives the process that wrote it.
- It does not know what a job's life looks like: `Job` does.

`tests/jobs/test_stores.py` examines every backend.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from racecraft.contract.errors import nearest
from racecraft.jobs.job import Job
from racecraft.jobs.states import JobError


class NameTakenError(JobError):
    """A job of that name is in the store already."""


class JobStore(Protocol):
    """Holds jobs."""

    def add(self, job: Job) -> None:
        """Take a new job.

        Raises:
            NameTakenError: There is one of that name.
        """
        ...

    def find(self, name: str) -> Job | None:
        """Return the job of a name; None: there is none."""
        ...

    def jobs(self) -> list[Job]:
        """Return all jobs, the oldest first."""
        ...

    def open_jobs(self) -> list[Job]:
        """Return the jobs that have not ended, the oldest first."""
        ...

    def replace(self, before: Job, after: Job) -> bool:
        """Put `after`, its revision counted on, in the place of `before`; False: that is not what stands there."""
        ...

    def remove(self, job: Job) -> bool:
        """Take a job out; False: it has changed, or is gone."""
        ...


def get(store: JobStore, name: str) -> Job:
    """Return the job of a name.

    Raises:
        JobError: There is none; the nearest name is told.
    """
    job = store.find(name)
    if job is None:
        names = [one.name for one in store.jobs()]
        known = nearest(name, names) if names else "There are none yet; `--detach` behind a training makes one."
        raise JobError("There is no job '{name}'. {known}", name=name, known=known)
    return job


def change(store: JobStore, name: str, how: Callable[[Job], Job]) -> Job:
    """Change a job, however many others do at the same time; return what stands now.

    Args:
        store: Where it is held.
        name: Which one.
        how: Makes the new job of the old one; returns the same one where nothing is to be done.

    Raises:
        JobError: There is no such job. Whatever `how` raises comes too.
    """
    while True:
        before = get(store, name)
        after = how(before)
        if after is before:
            return before
        if store.replace(before, after):
            return get(store, name)


def name_taken(name: str) -> NameTakenError:
    """Return the error about a name that is taken."""
    return NameTakenError(
        "There is a job '{name}' already; expected a new name. Give another, or `racecraft jobs delete {name}`.",
        name=name,
    )
