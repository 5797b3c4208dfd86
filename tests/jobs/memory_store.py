"""A store of jobs in memory, for tests of what works on one."""

import threading
from dataclasses import replace

from racecraft.jobs.job import Job
from racecraft.jobs.store import name_taken


class MemoryStore:
    """Holds jobs as long as the process lives; no other process sees them."""

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
