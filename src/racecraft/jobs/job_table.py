"""What every database of jobs holds, whoever speaks to it: two tables, one row a job, and the letters about them.

racecraft_store   name, value: the version
racecraft_jobs    name, created (seconds since 1970), state, revision, told (the job as JSON)
"""

from __future__ import annotations

import json
from typing import Any

from racecraft.contract.errors import UserInputError
from racecraft.jobs.job import Job, job_of

VERSION = 1
PATIENCE_SECONDS = 30.0
"""How long a statement waits for others that write."""


class JobStoreError(UserInputError):
    """A store of jobs cannot be opened, read or written."""


def row(job: Job) -> dict[str, Any]:
    """Return the columns of a job that change with it."""
    return {"state": job.state.value, "revision": job.revision, "told": json.dumps(job.as_dictionary())}


def job_in(told: str) -> Job:
    """Return the job that a row tells."""
    return job_of(json.loads(told))


def other_version(place: str, version: object) -> JobStoreError:
    """Return the letter about a store that another racecraft made."""
    return JobStoreError(
        "{place}: a store of version {version}; expected {known}. Another racecraft made it: use that one, or begin "
        "a new store with RACECRAFT_JOB_STORE.",
        place=place,
        version=version,
        known=VERSION,
    )


def what_happened(said: str) -> str:
    """Return what a database said, as a letter goes on after naming the place."""
    if "full" in said:
        return f"the disk is full ({said}); nothing was changed there. Free some space and run the same command again."
    if "not a database" in said:
        return f"no store of jobs ({said}); expected one that racecraft made. Move it away, and a new one is made."
    if "readonly" in said or "unable to open" in said:
        return f"cannot be written ({said}); expected a place that you may write to."
    return f"the database refuses ({said}); expected one that answers."
