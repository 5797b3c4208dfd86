"""A store of jobs on any database that SQLAlchemy knows. It promises what `store.py` says, and keeps `job_table.py`.

Every write is one statement that names the revision it changes, so that the database itself decides who was first;
nothing is locked between two statements.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import sqlalchemy as sql
from sqlalchemy.exc import ArgumentError, DBAPIError, IntegrityError, NoSuchModuleError, SQLAlchemyError

from racecraft.jobs.job import Job
from racecraft.jobs.job_table import PATIENCE_SECONDS, VERSION, JobStoreError, job_in, other_version, row, what_happened
from racecraft.jobs.store import name_taken

_tables = sql.MetaData()
_about = sql.Table(
    "racecraft_store",
    _tables,
    sql.Column("name", sql.String(32), primary_key=True),
    sql.Column("value", sql.String(255), nullable=False),
)
_jobs = sql.Table(
    "racecraft_jobs",
    _tables,
    sql.Column("name", sql.String(63), primary_key=True),
    sql.Column("created", sql.Float(53), nullable=False, index=True),
    sql.Column("state", sql.String(32), nullable=False),
    sql.Column("revision", sql.Integer, nullable=False),
    sql.Column("told", sql.Text, nullable=False),
)


class SqlStore:
    """Holds jobs in a database.

    Args:
        url: SQLAlchemy's, such as "sqlite:////home/me/jobs.sqlite" or "postgresql://host/jobs".

    Raises:
        JobStoreError: No such database, one that cannot be written, or one of another version.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        with self._letters():
            self._engine = _engine(url)
        try:
            with self._letters():
                _tables.create_all(self._engine)
                with self._engine.connect() as connection, contextlib.suppress(IntegrityError):
                    connection.execute(_about.insert().values(name="version", value=str(VERSION)))
            self._require_version()
        except JobStoreError:
            self.close()
            raise

    def add(self, job: Job) -> None:
        """Take a new job."""
        try:
            with self._letters(), self._engine.connect() as connection:
                connection.execute(_jobs.insert().values(name=job.name, created=job.created, **row(job)))
        except IntegrityError:
            raise name_taken(job.name) from None

    def find(self, name: str) -> Job | None:
        """Return the job of a name."""
        with self._letters(), self._engine.connect() as connection:
            told = connection.execute(sql.select(_jobs.c.told).where(_jobs.c.name == name)).scalar()
        return None if told is None else job_in(told)

    def jobs(self) -> list[Job]:
        """Return all jobs, the oldest first."""
        with self._letters(), self._engine.connect() as connection:
            rows = connection.execute(sql.select(_jobs.c.told).order_by(_jobs.c.created, _jobs.c.name)).scalars().all()
        return [job_in(told) for told in rows]

    def replace(self, before: Job, after: Job) -> bool:
        """Put `after` in the place of `before`."""
        after = replace(after, revision=before.revision + 1)
        held = (_jobs.c.name == before.name) & (_jobs.c.revision == before.revision)
        return self._changes_one(_jobs.update().where(held).values(**row(after)))

    def remove(self, job: Job) -> bool:
        """Take a job out."""
        return self._changes_one(_jobs.delete().where((_jobs.c.name == job.name) & (_jobs.c.revision == job.revision)))

    def close(self) -> None:
        """Let go of the database."""
        self._engine.dispose()

    def _changes_one(self, statement: Any) -> bool:
        with self._letters(), self._engine.connect() as connection:
            return bool(connection.execute(statement).rowcount == 1)

    def _require_version(self) -> None:
        with self._letters(), self._engine.connect() as connection:
            version = connection.execute(sql.select(_about.c.value).where(_about.c.name == "version")).scalar()
        if version != str(VERSION):
            raise other_version(self._place(), version)

    @contextlib.contextmanager
    def _letters(self) -> Iterator[None]:
        """Turn what a database raises into letters."""
        try:
            yield
        except IntegrityError:
            raise
        except NoSuchModuleError as error:
            raise JobStoreError(
                "{place}: SQLAlchemy knows no such database; expected an address such as "
                "sqlite:////home/me/jobs.sqlite or postgresql://host/jobs.",
                place=self._place(),
            ) from error
        except ArgumentError as error:
            raise JobStoreError(
                "{place}: no address of a database; expected one such as sqlite:////home/me/jobs.sqlite.",
                place=self._place(),
            ) from error
        except ModuleNotFoundError as error:
            raise JobStoreError(
                "{place}: this database needs the package {name}; expected it installed. pip install {name}",
                place=self._place(),
                name=error.name,
            ) from error
        except DBAPIError as error:
            raise JobStoreError(
                "{place}: {what_happened}", place=self._place(), what_happened=what_happened(str(error.orig))
            ) from error
        except SQLAlchemyError as error:
            raise JobStoreError("{place}: {error}", place=self._place(), error=error) from error

    def _place(self) -> str:
        try:
            return sql.make_url(self.url).render_as_string(hide_password=True)
        except SQLAlchemyError:
            return self.url


def _engine(url: str) -> sql.Engine:
    address = sql.make_url(url)
    options: dict[str, Any] = {"isolation_level": "AUTOCOMMIT"}
    if address.get_backend_name() == "sqlite":
        if address.database and address.database != ":memory:":
            Path(address.database).parent.mkdir(parents=True, exist_ok=True)
        options["connect_args"] = {"timeout": PATIENCE_SECONDS}
    return sql.create_engine(address, **options)
