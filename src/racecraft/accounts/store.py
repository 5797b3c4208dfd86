"""Accounts in the store that holds jobs: people, and the log of what owners and organisers did. Begin with `Accounts`.

Nothing here is a secret by itself: passwords are kept as Argon2 hashes, tokens of links and cookies as SHA-256.
"""

from __future__ import annotations

import contextlib
import json
import secrets
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sql
from sqlalchemy.exc import IntegrityError

from racecraft.accounts.passwords import hash_password, is_outdated, matches
from racecraft.accounts.people import LOCAL_OWNER, AccountError, Person, Role, legal_name, name_key
from racecraft.accounts.tables import ACTS, INVITATIONS, PEOPLE, SESSIONS
from racecraft.contract.errors import nearest
from racecraft.contract.message import shortened
from racecraft.database.engine import database_errors, one_transaction, open_engine
from racecraft.database.migrate import migrate


@dataclass(frozen=True, kw_only=True)
class Act:
    """One line of the log."""

    time: float
    name: str
    """Who did it."""
    what: str
    subject: str
    """To whom or to what."""
    detail: Mapping[str, Any]


class Accounts:
    """People in a database.

    Args:
        url: SQLAlchemy's address of the store of jobs.

    Raises:
        DatabaseError: It cannot be opened or written.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        self._engine = open_engine(url)
        migrate(self._engine)

    def close(self) -> None:
        """Close the database."""
        self._engine.dispose()

    def people(self) -> list[Person]:
        """Return everybody, by name; the owner of the machine has no row."""
        with self.connected() as connection:
            rows = connection.execute(sql.select(PEOPLE).order_by(PEOPLE.c.name_key)).all()
        return [_person(row) for row in rows]

    def named(self, name: str) -> Person:
        """Return a person by name.

        Raises:
            AccountError: There is none.
        """
        found = self._row(PEOPLE.c.name_key == name_key(name))
        if found is None:
            hint = nearest(name, [person.name for person in self.people()])
            raise AccountError("{name}: there is no such person. {hint}", name=shortened(name, 60), hint=hint)
        return _person(found)

    def find(self, id: str) -> Person | None:
        """Return a person by id; None: removed, or never there."""
        if not id:
            return LOCAL_OWNER
        found = self._row(PEOPLE.c.id == id)
        return None if found is None else _person(found)

    def add(self, name: str, role: Role) -> Person:
        """Return a new person, who has no password yet.

        Raises:
            SettingError: The name cannot be used.
            AccountError: It is taken.
        """
        name = legal_name(name)
        values = {"id": secrets.token_hex(8), "name": name, "name_key": name_key(name), "role": role.value,
                  "password": "", "created": time.time()}  # fmt: skip
        if values["name_key"] == name_key(LOCAL_OWNER.name):
            raise _taken(name)
        try:
            with self.connected() as connection:
                connection.execute(PEOPLE.insert().values(values))
        except IntegrityError:
            raise _taken(name) from None
        return Person(id=str(values["id"]), name=name, role=role, created=float(str(values["created"])),
                      has_password=False)  # fmt: skip

    def remove(self, person: Person) -> None:
        """Remove a person with invitation and sessions; models and results stay."""
        with self.connected() as connection, one_transaction(connection):
            for table, column in ((PEOPLE, PEOPLE.c.id), (INVITATIONS, INVITATIONS.c.person),
                                  (SESSIONS, SESSIONS.c.person)):  # fmt: skip
                connection.execute(table.delete().where(column == person.id))

    def set_role(self, person: Person, role: Role) -> Person:
        """Return a person with another role; where it is lower, every session of theirs ends."""
        with self.connected() as connection, one_transaction(connection):
            connection.execute(PEOPLE.update().where(PEOPLE.c.id == person.id).values(role=role.value))
            if role.rank < person.role.rank:
                connection.execute(SESSIONS.delete().where(SESSIONS.c.person == person.id))
        return Person(id=person.id, name=person.name, role=role, created=person.created,
                      has_password=person.has_password)  # fmt: skip

    def set_password(self, person: Person, password: str) -> None:
        """Keep another password; every session and link of the person ends.

        Raises:
            AccountError: The password is not accepted.
        """
        kept = hash_password(password, person.name)
        with self.connected() as connection, one_transaction(connection):
            connection.execute(PEOPLE.update().where(PEOPLE.c.id == person.id).values(password=kept))
            connection.execute(SESSIONS.delete().where(SESSIONS.c.person == person.id))
            connection.execute(INVITATIONS.delete().where(INVITATIONS.c.person == person.id))

    def with_password(self, name: str, password: str) -> Person:
        """Return the person to whom a name and a password belong.

        Raises:
            AccountError: They belong to nobody; the message does not tell which of the two is wrong.
        """
        found = self._row(PEOPLE.c.name_key == name_key(name[:128]))
        if not matches(found.password if found else "", password) or found is None:
            raise AccountError("No account has this name and password. A forgotten password: ask who invited you.")
        if is_outdated(found.password):
            kept = hash_password(password, found.name)
            with self.connected() as connection:
                connection.execute(PEOPLE.update().where(PEOPLE.c.id == found.id).values(password=kept))
        return _person(found)

    def log(self, person: Person, what: str, subject: str, **detail: Any) -> None:
        """Add a line to the log.

        Args:
            person: Who did it.
            what: "invite", "close race", …
            subject: To whom or to what.
            detail: Further facts that JSON can hold; never a password or token.
        """
        values = {"time": time.time(), "person": person.id, "name": person.name, "what": what[:64],
                  "subject": subject[:128], "detail": json.dumps(detail, default=str)}  # fmt: skip
        with self.connected() as connection:
            connection.execute(ACTS.insert().values(values))

    def acts(self, most: int = 100) -> list[Act]:
        """Return the last lines of the log, the newest first."""
        with self.connected() as connection:
            rows = connection.execute(sql.select(ACTS).order_by(ACTS.c.number.desc()).limit(most)).all()
        return [
            Act(time=row.time, name=row.name, what=row.what, subject=row.subject, detail=json.loads(row.detail))
            for row in rows
        ]

    @contextlib.contextmanager
    def connected(self) -> Iterator[sql.Connection]:
        """Yield a connection; what the database refuses becomes a `DatabaseError`."""
        with database_errors(self.url), self._engine.connect() as connection:
            yield connection

    def _row(self, where: sql.ColumnElement[bool]) -> Any:
        with self.connected() as connection:
            return connection.execute(sql.select(PEOPLE).where(where)).first()


def _person(row: Any) -> Person:
    return Person(id=row.id, name=row.name, role=Role(row.role), created=row.created, has_password=bool(row.password))


def _taken(name: str) -> AccountError:
    return AccountError("{name}: there is a person of that name; expected another.", name=name)
