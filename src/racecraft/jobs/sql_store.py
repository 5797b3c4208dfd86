"""A store of jobs in a database that SQLAlchemy knows, SQLite by default. It promises what `store.py` says.

Every write is one statement that names the revision it changes, so that the database itself decides who was first;
nothing is locked between two statements.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import sqlalchemy as sql
from sqlalchemy.exc import IntegrityError

from racecraft.database.engine import DatabaseError, database_errors, open_engine
from racecraft.database.migrate import migrate
from racecraft.jobs.job import Job, job_of
from racecraft.jobs.states import ENDED
from racecraft.jobs.store import name_taken

_JOBS = sql.Table(
    "racecraft_jobs",
    sql.MetaData(),
    sql.Column("name", sql.String(63), primary_key=True),
    sql.Column("person", sql.String(64), nullable=False),
    sql.Column("created", sql.Float(53), nullable=False),
    sql.Column("state", sql.String(32), nullable=False),
    sql.Column("revision", sql.Integer, nullable=False),
    sql.Column("told", sql.Text, nullable=False),
)
"""`person` owns the job, "": the only user of the machine; `told` is the job as JSON."""


class SqlStore:
    """Holds jobs in a database.

    Args:
        url: SQLAlchemy's, such as "sqlite:////home/me/jobs.sqlite" or "postgresql://host/jobs".
        person: Whose jobs are added and seen; "": the owner of the machine adds and sees all.

    Raises:
        DatabaseError: No such database, one that cannot be written, or one of a newer version.
    """

    def __init__(self, url: str, person: str = "") -> None:
        self.url, self.person = url, person
        self._engine = open_engine(url, keeps_file_open=False)  # many ask one thing and never close it
        try:
            migrate(self._engine)
        except DatabaseError:
            self.close()
            raise

    def add(self, job: Job) -> None:
        """Take a new job."""
        values = {"name": job.name, "person": self.person, "created": job.created, **_row(job)}
        try:
            with self._connected() as connection:
                connection.execute(_JOBS.insert().values(values))
        except IntegrityError:
            raise name_taken(job.name) from None

    def find(self, name: str) -> Job | None:
        """Return the job of a name."""
        with self._connected() as connection:
            text = connection.execute(sql.select(_JOBS.c.told).where(self._seen(_JOBS.c.name == name))).scalar()
        return None if text is None else _job_in(text)

    def jobs(self) -> list[Job]:
        """Return all jobs, the oldest first."""
        return self._found(sql.select(_JOBS.c.told).where(self._seen(sql.true())))

    def open_jobs(self) -> list[Job]:
        """Return the jobs that have not ended, the oldest first."""
        is_open = _JOBS.c.state.not_in([state.value for state in ENDED])
        return self._found(sql.select(_JOBS.c.told).where(self._seen(is_open)))

    def _found(self, statement: sql.Select[Any]) -> list[Job]:
        with self._connected() as connection:
            rows = connection.execute(statement.order_by(_JOBS.c.created, _JOBS.c.name)).scalars().all()
        return [_job_in(text) for text in rows]

    def replace(self, before: Job, after: Job) -> bool:
        """Put `after` in the place of `before`."""
        after = replace(after, revision=before.revision + 1)
        held = (_JOBS.c.name == before.name) & (_JOBS.c.revision == before.revision)
        return self._changes_one(_JOBS.update().where(self._seen(held)).values(**_row(after)))

    def remove(self, job: Job) -> bool:
        """Take a job out."""
        held = (_JOBS.c.name == job.name) & (_JOBS.c.revision == job.revision)
        return self._changes_one(_JOBS.delete().where(self._seen(held)))

    def close(self) -> None:
        """Let go of the database."""
        self._engine.dispose()

    def _seen(self, where: sql.ColumnElement[bool]) -> sql.ColumnElement[bool]:
        return where & (_JOBS.c.person == self.person) if self.person else where

    def _changes_one(self, statement: Any) -> bool:
        with self._connected() as connection:
            return bool(connection.execute(statement).rowcount == 1)

    @contextlib.contextmanager
    def _connected(self) -> Iterator[sql.Connection]:
        with database_errors(self.url), self._engine.connect() as connection:
            yield connection


def _row(job: Job) -> dict[str, Any]:
    """Return the columns of a job that change with it."""
    return {"state": job.state.value, "revision": job.revision, "told": json.dumps(job.as_dictionary())}


def _job_in(text: str) -> Job:
    return job_of(json.loads(text))
