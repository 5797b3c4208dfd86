"""Who may do what: one table, asked by the console's routes and by the verbs of a league. Begin with `RIGHTS`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from racecraft.accounts.people import AccountError, Person, Role


class Verb(StrEnum):
    """What somebody wants to do."""

    WATCH = "watch races and boards"
    USE_ACCOUNT = "use an account"
    KEEP_MODELS = "make, train, read and download models"
    ENTER = "enter and withdraw cars"
    ORGANISE = "make, change, judge and close races"
    INVITE = "invite people and take invitations back"
    APPOINT = "change roles and remove people"
    RUN_MACHINE = "see the machine: folders, every job, the bin"


@dataclass(frozen=True)
class Right:
    """The least role that a verb needs; None: nobody may."""

    own: Role
    """On one's own things."""
    of_others: Role | None = None
    """On another person's."""


RIGHTS: Mapping[Verb, Right] = {
    Verb.WATCH: Right(Role.SPECTATOR, Role.SPECTATOR),
    Verb.USE_ACCOUNT: Right(Role.SPECTATOR),
    Verb.KEEP_MODELS: Right(Role.RACER),
    Verb.ENTER: Right(Role.RACER, Role.ORGANISER),
    Verb.ORGANISE: Right(Role.ORGANISER, Role.ORGANISER),
    Verb.INVITE: Right(Role.ORGANISER, Role.ORGANISER),
    Verb.APPOINT: Right(Role.OWNER, Role.OWNER),
    Verb.RUN_MACHINE: Right(Role.OWNER, Role.OWNER),
}
"""A shared model is read as a copy of one's own, so KEEP_MODELS never reaches another person's."""


class NotAllowedError(AccountError):
    """A person's role does not allow what was asked."""


def may(person: Person, verb: Verb, owner: str | None = None) -> bool:
    """Tell whether a person may do something.

    Args:
        person: Who asks.
        verb: What for.
        owner: Whose thing it is, as `Person.owned`; None: the person's own, or nobody's.
    """
    right = RIGHTS[verb]
    least = right.own if owner is None or owner == person.owned else right.of_others
    return least is not None and person.role.rank >= least.rank


def require(person: Person, verb: Verb, owner: str | None = None) -> None:
    """Refuse what a person may not do.

    Raises:
        NotAllowedError: The message names the role that may.
    """
    if may(person, verb, owner):
        return
    right = RIGHTS[verb]
    is_own = owner is None or owner == person.owned
    least = right.own if is_own else right.of_others
    if least is None:
        raise NotAllowedError("This belongs to somebody else; only its owner may {verb}.", verb=verb.value)
    raise NotAllowedError(
        "{name} is {role}; expected {least} or more to {verb}. The owner of this console gives roles.",
        name=person.name, role=f"a {person.role}", least=least.value, verb=verb.value,
    )  # fmt: skip


def require_gives(person: Person, role: Role) -> None:
    """Refuse to give a role that is not below one's own; an owner gives every role.

    Raises:
        NotAllowedError: It is not below.
    """
    if person.role is not Role.OWNER and role.rank >= person.role.rank:
        raise NotAllowedError(
            "{name} is {own}; expected a role below that, found {role}. The owner of this console gives it.",
            name=person.name, own=f"an {person.role}" if person.role is Role.ORGANISER else f"a {person.role}",
            role=role.value,
        )  # fmt: skip
