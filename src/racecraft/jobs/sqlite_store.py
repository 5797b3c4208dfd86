"""A store of jobs in one SQLite file, by Python's own module: what an account has unless it names another database.

The same two tables as `sql_store.py` keeps, so that either opens what the other wrote; but SQLAlchemy takes a quarter
of a second to import, and every command about a job, and its supervisor, would wait for it. Every call has a connection
of its own, and every write is one statement that names the revision it changes.
"""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from racecraft.jobs.job import Job
from racecraft.jobs.job_table import PATIENCE_SECONDS, VERSION, JobStoreError, job_in, other_version, row, what_happened
from racecraft.jobs.store import name_taken

ADDRESS = "sqlite:///"
_TABLES = (
    "create table if not exists racecraft_store"
    " (name varchar(32) not null, value varchar(255) not null, primary key (name))",
    "create table if not exists racecraft_jobs"
    " (name varchar(63) not null, created float not null, state varchar(32) not null, revision integer not null,"
    " told text not null, primary key (name))",
    "create index if not exists ix_racecraft_jobs_created on racecraft_jobs (created)",
)


def file_of(url: str) -> Path | None:
    """Return the file that an address names; None: it is no plain file of SQLite's.

    >>> file_of("sqlite:////home/me/jobs.sqlite").as_posix()
    '/home/me/jobs.sqlite'
    >>> file_of("sqlite:///jobs.sqlite?mode=ro"), file_of("sqlite://"), file_of("postgresql://host/jobs")
    (None, None, None)
    """
    name = url.removeprefix(ADDRESS)
    return None if name in (url, "", ":memory:") or "?" in name else Path(name)


class SqliteStore:
    """Holds jobs in a SQLite file.

    Args:
        path: The file; made where there is none.

    Raises:
        JobStoreError: It cannot be written, is none, or is of another version.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with self._connected() as connection:
            for table in _TABLES:
                connection.execute(table)
            if (version := _version(connection)) is None:
                connection.execute("insert or ignore into racecraft_store values ('version', ?)", (str(VERSION),))
                version = _version(connection)
        if version != str(VERSION):
            raise other_version(self._place, version)

    def add(self, job: Job) -> None:
        """Take a new job."""
        columns = {"name": job.name, "created": job.created, **row(job)}
        with self._connected() as connection:
            try:
                connection.execute(
                    "insert into racecraft_jobs (name, created, state, revision, told)"
                    " values (:name, :created, :state, :revision, :told)",
                    columns,
                )
            except sqlite3.IntegrityError:
                raise name_taken(job.name) from None

    def find(self, name: str) -> Job | None:
        """Return the job of a name."""
        with self._connected() as connection:
            told = connection.execute("select told from racecraft_jobs where name = ?", (name,)).fetchone()
        return None if told is None else job_in(told[0])

    def jobs(self) -> list[Job]:
        """Return all jobs, the oldest first."""
        with self._connected() as connection:
            rows = connection.execute("select told from racecraft_jobs order by created, name").fetchall()
        return [job_in(told) for (told,) in rows]

    def replace(self, before: Job, after: Job) -> bool:
        """Put `after` in the place of `before`."""
        columns = row(replace(after, revision=before.revision + 1))
        return self._changes_one(
            "update racecraft_jobs set state = :state, revision = :revision, told = :told"
            " where name = :name and revision = :held",
            {**columns, "name": before.name, "held": before.revision},
        )

    def remove(self, job: Job) -> bool:
        """Take a job out."""
        held = {"name": job.name, "held": job.revision}
        return self._changes_one("delete from racecraft_jobs where name = :name and revision = :held", held)

    def close(self) -> None:
        """Let go of the file; no call keeps it open."""

    def _changes_one(self, statement: str, columns: dict[str, object]) -> bool:
        with self._connected() as connection:
            return connection.execute(statement, columns).rowcount == 1

    @contextlib.contextmanager
    def _connected(self) -> Iterator[sqlite3.Connection]:
        """Open the file for one call; what SQLite raises becomes a letter."""
        try:
            with contextlib.closing(self._open()) as connection:
                yield connection
        except (sqlite3.Error, OSError) as error:
            raise JobStoreError(
                "{place}: {what_happened}", place=self._place, what_happened=what_happened(str(error))
            ) from error

    def _open(self) -> sqlite3.Connection:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        return sqlite3.connect(self.path, timeout=PATIENCE_SECONDS, isolation_level=None)

    @property
    def _place(self) -> str:
        return f"{ADDRESS}{self.path}"


def _version(connection: sqlite3.Connection) -> str | None:
    told = connection.execute("select value from racecraft_store where name = 'version'").fetchone()
    return None if told is None else str(told[0])
