"""Who is signed in: sessions in the store, known to a browser by a random token that is replaced every hour.

Begin with `Sessions.find`.
"""

from __future__ import annotations

import secrets
import time
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sql

from racecraft.accounts.invitations import token_hash
from racecraft.accounts.people import LOCAL_OWNER, Person
from racecraft.accounts.store import Accounts
from racecraft.accounts.tables import SESSIONS
from racecraft.database.engine import one_transaction

IDLE_SECONDS, MAX_SECONDS = 7 * 86400.0, 30 * 86400.0
"""A session ends when nobody came for so long, and at last so long after the sign-in."""
RENEW_SECONDS, OVERLAP_SECONDS = 3600.0, 60.0
"""A token is replaced when it is older; the old one works a moment longer, for requests that are under way."""


@dataclass(frozen=True)
class SignedIn:
    """Whose request this is."""

    person: Person
    session: str
    """Names the session as long as it lasts; it opens nothing."""
    renewed: str = ""
    """The token that takes the place of the one shown; "": that one stays."""


class Sessions:
    """Sessions of people.

    Args:
        accounts: Whose.
    """

    owner = LOCAL_OWNER
    """Whoever holds the token that the terminal printed."""

    def __init__(self, accounts: Accounts) -> None:
        self._accounts = accounts

    def begin(self, person: Person) -> str:
        """Sign a person in and return the token for the cookie; it is new, whatever the browser had before."""
        now, token = time.time(), secrets.token_urlsafe(32)
        with self._accounts.connected() as connection:
            connection.execute(SESSIONS.delete().where(SESSIONS.c.ends < now))
            self._insert(connection, token, secrets.token_hex(16), person.id, now, now)
        return token

    def find(self, token: str) -> SignedIn | None:
        """Return whose token this is; None: nobody's, or no longer."""
        now, kept = time.time(), token_hash(token)
        with self._accounts.connected() as connection:
            found = connection.execute(sql.select(SESSIONS).where(SESSIONS.c.token == kept)).first()
            if found is None or found.ends < now:
                return None
        person = self._accounts.find(found.person)
        if person is None:
            return None
        renewed = self._renewed(found, now) if now - found.issued > RENEW_SECONDS else ""
        return SignedIn(person, found.session, renewed)

    def end(self, session: str) -> None:
        """Sign out of one session."""
        with self._accounts.connected() as connection:
            connection.execute(SESSIONS.delete().where(SESSIONS.c.session == session))

    def end_all(self, person: Person) -> int:
        """Sign a person out everywhere; return of how many sessions."""
        with self._accounts.connected() as connection:
            where = SESSIONS.c.person == person.id
            count = connection.execute(sql.select(sql.func.count(SESSIONS.c.session.distinct())).where(where)).scalar()
            connection.execute(SESSIONS.delete().where(where))
        return int(count or 0)

    def count(self, person: Person) -> int:
        """Return how many sessions of a person go on."""
        where = (SESSIONS.c.person == person.id) & (SESSIONS.c.ends > time.time())
        with self._accounts.connected() as connection:
            counted = sql.select(sql.func.count(SESSIONS.c.session.distinct())).where(where)
            return int(connection.execute(counted).scalar() or 0)

    def _renewed(self, found: Any, now: float) -> str:
        """Replace a token; of several requests that find it old one does, and the others go on with the old one."""
        token = secrets.token_urlsafe(32)
        old = (SESSIONS.c.token == found.token) & (SESSIONS.c.issued == found.issued)
        with self._accounts.connected() as connection, one_transaction(connection):
            shortened = SESSIONS.update().where(old).values(ends=now + OVERLAP_SECONDS, issued=now)
            if connection.execute(shortened).rowcount != 1:
                return ""
            self._insert(connection, token, found.session, found.person, found.began, now)
        return token

    def _insert(
        self, connection: sql.Connection, token: str, session: str, person: str, began: float, now: float
    ) -> None:
        ends = min(now + IDLE_SECONDS, began + MAX_SECONDS)
        connection.execute(SESSIONS.insert().values(
            token=token_hash(token), session=session, person=person, began=began, issued=now, ends=ends,
        ))  # fmt: skip
