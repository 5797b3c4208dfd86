"""Open a database that SQLAlchemy knows, and turn what it raises into errors for people. Begin with `open_engine`."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import sqlalchemy as sql
from sqlalchemy.exc import ArgumentError, DBAPIError, IntegrityError, NoSuchModuleError, SQLAlchemyError

from racecraft.contract.errors import UserInputError

PATIENCE_SECONDS = 30.0
"""How long a statement waits for others that write."""


class DatabaseError(UserInputError):
    """A database cannot be opened, read or written."""


def open_engine(url: str, *, keeps_file_open: bool = True) -> sql.Engine:
    """Return an engine that commits every statement by itself; the folder of a SQLite file is made.

    Args:
        url: SQLAlchemy's, such as "sqlite:////home/me/jobs.sqlite" or "postgresql://host/jobs".
        keeps_file_open: Whether a SQLite file stays open between statements, which saves 0.4 ms each and asks for
            `dispose` in the end.

    Raises:
        DatabaseError: The address names no database, or one whose driver is not installed.
    """
    with database_errors(url):
        address = sql.make_url(url)
        options: dict[str, Any] = {"isolation_level": "AUTOCOMMIT"}
        if address.get_backend_name() == "sqlite":
            if address.database and address.database != ":memory:":
                Path(address.database).parent.mkdir(parents=True, exist_ok=True)
            options["connect_args"] = {"timeout": PATIENCE_SECONDS}
            if not keeps_file_open:
                options["poolclass"] = sql.NullPool
        return sql.create_engine(address, **options)


@contextlib.contextmanager
def database_errors(url: str) -> Iterator[None]:
    """Turn what a database raises into a `DatabaseError`; an `IntegrityError` passes.

    Args:
        url: Its address, for the message; a password in it is hidden.
    """
    try:
        yield
    except IntegrityError:
        raise
    except NoSuchModuleError as error:
        raise DatabaseError(
            "{place_of}: SQLAlchemy knows no such database; expected an address such as "
            "sqlite:////home/me/jobs.sqlite or postgresql://host/jobs.",
            place_of=place_of(url),
        ) from error
    except ArgumentError as error:
        raise DatabaseError(
            "{place_of}: no address of a database; expected one such as sqlite:////home/me/jobs.sqlite.",
            place_of=place_of(url),
        ) from error
    except ModuleNotFoundError as error:
        raise DatabaseError(
            "{place_of}: this database needs the package {name}; expected it installed. pip install {name}",
            place_of=place_of(url),
            name=error.name,
        ) from error
    except DBAPIError as error:
        raise DatabaseError(
            "{place_of}: {what_happened}", place_of=place_of(url), what_happened=_what_happened(str(error.orig))
        ) from error
    except (SQLAlchemyError, OSError) as error:
        raise DatabaseError(
            "{place_of}: {what_happened}", place_of=place_of(url), what_happened=_what_happened(str(error))
        ) from error


@contextlib.contextmanager
def one_transaction(connection: sql.Connection) -> Iterator[None]:
    """Make several statements of a connection from `open_engine` one change: others see all of it or none."""
    connection.exec_driver_sql("begin")
    try:
        yield
        connection.exec_driver_sql("commit")
    except BaseException:
        with contextlib.suppress(DBAPIError):  # SQLite has rolled back by itself where the disk is full
            connection.exec_driver_sql("rollback")
        raise


def place_of(url: str) -> str:
    """Return an address without its password."""
    try:
        return sql.make_url(url).render_as_string(hide_password=True)
    except SQLAlchemyError:
        return url


def _what_happened(text: str) -> str:
    """Return what a database said, as a message goes on after naming the place."""
    if "full" in text:
        return f"the disk is full ({text}); nothing was changed there. Free some space and run the same command again."
    if "not a database" in text:
        return f"no database of racecraft ({text}); expected one that racecraft made. Move it away; a new one is made."
    if "readonly" in text or "unable to open" in text:
        return f"cannot be written ({text}); expected a place that you may write to."
    return f"the database refuses ({text}); expected one that answers."
