"""Bring a database to the tables that this racecraft knows, by Alembic. Begin with `migrate`."""

from __future__ import annotations

from pathlib import Path

import sqlalchemy as sql

from racecraft.database.engine import DatabaseError, database_errors, place_of

HEAD = "0003"
"""The newest file of migrations/versions; it says so without an import of Alembic, which takes 0.2 s."""
FOLDER = Path(__file__).parent / "migrations"
LOCK = 7_263_001
"""What stands for racecraft's migrations among PostgreSQL's advisory locks."""


def migrate(engine: sql.Engine) -> None:
    """Make the tables, or change those of an older racecraft; of several processes one does it, the others wait.

    Raises:
        DatabaseError: The database cannot be written, or a newer racecraft made it.
    """
    url = engine.url.render_as_string(hide_password=False)
    with database_errors(url), engine.connect() as connection:
        if _version(connection) == HEAD:
            return
        _lock(connection)
        try:
            version = _version(connection)
            if version != HEAD:
                _upgrade(connection, version, url)
            _end(connection, "commit")
        except BaseException:
            _end(connection, "rollback")
            raise


def _upgrade(connection: sql.Connection, version: str | None, url: str) -> None:
    from alembic import command
    from alembic.config import Config
    from alembic.script import ScriptDirectory

    config = Config()
    config.set_main_option("script_location", str(FOLDER))
    config.attributes["connection"] = connection
    known = {one.revision for one in ScriptDirectory.from_config(config).walk_revisions()}
    if version is not None and version not in known:
        raise DatabaseError(
            "{place_of}: a database of version {version}; expected {head} or older. A newer racecraft made it: "
            "use that one, or begin a new database with RACECRAFT_JOB_STORE.",
            place_of=place_of(url),
            version=version,
            head=HEAD,
        )
    command.upgrade(config, HEAD)


def _version(connection: sql.Connection) -> str | None:
    """Return the version of a database; None where it was never migrated."""
    if not sql.inspect(connection).has_table("alembic_version"):
        return None
    found = connection.execute(sql.text("select version_num from alembic_version")).scalar()
    return None if found is None else str(found)


def _lock(connection: sql.Connection) -> None:
    """Begin a transaction that others wait for."""
    if connection.dialect.name == "sqlite":
        connection.exec_driver_sql("begin immediate")
        return
    connection.exec_driver_sql("begin")
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"select pg_advisory_xact_lock({LOCK})")


def _end(connection: sql.Connection, how: str) -> None:
    if not connection.closed:
        connection.exec_driver_sql(how)
