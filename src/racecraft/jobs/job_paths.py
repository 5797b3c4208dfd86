"""Where the jobs of this account lie. Begin with `JobPaths.of_user`.

Layout of the folder, what `RACECRAFT_JOBS` names or `racecraft/jobs` where this system keeps a user's data::

    jobs.sqlite        the store, unless RACECRAFT_JOB_STORE names another (any address SQLAlchemy knows)
    run.lock           held by this machine's supervisor
    supervisor.log     what it said
    NAME/              a folder for each job
        job_spec.json  what it is to do
        log.txt        what it said
        log_times.txt  when: lines of "seconds bytes", how long the log was at that time
"""

from __future__ import annotations

import os
import shutil
import socket
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.formats.atomic import make_folder
from racecraft.formats.user_folder import data_folder

if TYPE_CHECKING:
    from racecraft.jobs.sql_store import SqlStore

FOLDER_VARIABLE, STORE_VARIABLE = "RACECRAFT_JOBS", "RACECRAFT_JOB_STORE"


@dataclass(frozen=True)
class JobPaths:
    """The folder of an account's jobs, and the address of their store."""

    path: Path
    store_url: str
    person: str = ""
    """Whose jobs are added and seen; "": the owner of the machine adds and sees all."""

    @classmethod
    def of_user(cls, environment: Mapping[str, str] = os.environ) -> JobPaths:
        """Return where the jobs of this account lie; the folder need not exist."""
        named = environment.get(FOLDER_VARIABLE)
        path = (Path(named) if named else data_folder(environment) / "jobs").absolute()
        return cls(path, environment.get(STORE_VARIABLE) or f"sqlite:///{path / 'jobs.sqlite'}")

    @property
    def supervisor(self) -> str:
        """What this machine's supervisor calls itself: no two live at once under one name (see `run.lock`)."""
        return f"{socket.gethostname()}:{self.path}"

    @property
    def is_shared(self) -> bool:
        """Whether the store may be other machines', too."""
        return not self.store_url.startswith(f"sqlite:///{self.path}")

    @property
    def has_store(self) -> bool:
        """Whether the store was opened before, as far as this machine can tell."""
        return self.is_shared or (self.path / "jobs.sqlite").is_file()

    def store(self) -> SqlStore:
        """Open the store.

        Raises:
            DatabaseError: It cannot be opened.
            OutputFileError: The folder cannot be made.
        """
        from racecraft.jobs.sql_store import SqlStore

        make_folder(self.path)
        return SqlStore(self.store_url, self.person)

    def folder(self, name: str) -> Path:
        """Return a job's own folder; it need not exist."""
        return self.path / name

    def log(self, name: str) -> Path:
        """Return where a job's words lie."""
        return self.folder(name) / "log.txt"

    def log_times(self, name: str) -> Path:
        """Return where it is told when they were said."""
        return self.folder(name) / "log_times.txt"

    def spec(self, name: str) -> Path:
        """Return where it is told what a job is to do."""
        return self.folder(name) / "job_spec.json"

    def delete(self, name: str) -> None:
        """Take a job's own folder away; its run folder stays."""
        shutil.rmtree(self.folder(name), ignore_errors=True)
