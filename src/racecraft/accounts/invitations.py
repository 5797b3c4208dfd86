"""Links by which an account gets its password, first or anew; each works once. Begin with `invite`."""

from __future__ import annotations

import hashlib
import secrets
import time

import sqlalchemy as sql

from racecraft.accounts.people import AccountError, Person, Role
from racecraft.accounts.rights import Verb, require, require_gives
from racecraft.accounts.store import Accounts
from racecraft.accounts.tables import INVITATIONS
from racecraft.database.engine import one_transaction

SECONDS = 14 * 86400.0
"""How long a link works."""


def invite(accounts: Accounts, by: Person, name: str, role: Role) -> tuple[Person, str]:
    """Return a new person and what their link holds.

    Raises:
        NotAllowedError: `by` may not invite, or not to this role.
        AccountError: The name is taken.
        SettingError: It cannot be used.
    """
    require(by, Verb.INVITE)
    require_gives(by, role)
    person = accounts.add(name, role)
    accounts.log(by, "invite", person.name, role=role.value)
    return person, _new_link(accounts, person)


def reset(accounts: Accounts, by: Person, person: Person) -> str:
    """Return what a new link of a person holds; an older one no longer works. The password stays until it is used.

    Raises:
        NotAllowedError: `by` may not invite, or not to this person's role.
    """
    require(by, Verb.INVITE)
    require_gives(by, person.role)
    accounts.log(by, "reset password", person.name)
    return _new_link(accounts, person)


def invited(accounts: Accounts, token: str) -> Person:
    """Return whose link this is.

    Raises:
        AccountError: It was used, is too old, or never was one.
    """
    where = (INVITATIONS.c.token == token_hash(token)) & (INVITATIONS.c.ends > time.time())
    with accounts.connected() as connection:
        id = connection.execute(sql.select(INVITATIONS.c.person).where(where)).scalar()
    person = accounts.find(id) if id else None
    if person is None:
        raise AccountError("This link was used already, or is too old; ask who invited you for another.")
    return person


def accept(accounts: Accounts, token: str, password: str) -> Person:
    """Keep the password that a person chose behind their link, and return them; the link works no more.

    Raises:
        AccountError: The link does not work, or the password is not accepted.
    """
    person = invited(accounts, token)
    accounts.set_password(person, password)
    return person


def _new_link(accounts: Accounts, person: Person) -> str:
    token, now = secrets.token_urlsafe(24), time.time()
    values = {"token": token_hash(token), "person": person.id, "created": now, "ends": now + SECONDS}
    with accounts.connected() as connection, one_transaction(connection):
        connection.execute(INVITATIONS.delete().where(INVITATIONS.c.person == person.id))
        connection.execute(INVITATIONS.insert().values(values))
    return token


def token_hash(token: str) -> str:
    """Return how a token is kept; it is random, so that a plain SHA-256 cannot be turned back."""
    return hashlib.sha256(token.encode("utf-8", "replace")).hexdigest()
