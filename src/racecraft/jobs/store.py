"""What a store of jobs promises, and the smallest one. Begin with `JobStore`.

A store's duties:

- It holds jobs by name; two never have the same.
- `replace` takes a change only of the very job it holds. Of several that change one job at once, from whatever thread,
  process or machine, exactly one is told True; the others are told False and look again. Everything that must happen
  once (a supervisor takes a job) is built on that.
- What `replace` or `add` has taken is seen by every later reader, and survives the process that wrote it (a store in
  memory: as long as its process lives).
- It does not know what a job's life looks like: `Job` does.

`tests/jobs/test_stores.py` examines every backend.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
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


class MemoryStore:
    """Holds jobs as long as the process lives; for tests, and for trying things."""

    def __init__(self) -> None:
        self._jobs: dict[str, Job] = {}
        self._one_at_a_time = threading.Lock()

    def add(self, job: Job) -> None:
        """Take a new job."""
        with self._one_at_a_time:
            if job.name in self._jobs:
                raise name_taken(job.name)
            self._jobs[job.name] = job

    def find(self, name: str) -> Job | None:
        """Return the job of a name."""
        return self._jobs.get(name)

    def jobs(self) -> list[Job]:
        """Return all jobs, the oldest first."""
        return sorted(self._jobs.values(), key=lambda job: (job.created, job.name))

    def open_jobs(self) -> list[Job]:
        """Return the jobs that have not ended, the oldest first."""
        return [job for job in self.jobs() if not job.ended]

    def replace(self, before: Job, after: Job) -> bool:
        """Put `after` in the place of `before`."""
        with self._one_at_a_time:
            held = self._jobs.get(before.name)
            if held is None or held.revision != before.revision:
                return False
            self._jobs[before.name] = replace(after, revision=before.revision + 1)
            return True

    def remove(self, job: Job) -> bool:
        """Take a job out."""
        with self._one_at_a_time:
            held = self._jobs.get(job.name)
            if held is None or held.revision != job.revision:
                return False
            del self._jobs[job.name]
            return True


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
