"""People who share a console: invite them, change their roles, help those who forgot their password."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.actions.action import action
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.accounts.store import Accounts

ROLES = ("owner", "organiser", "racer", "spectator")


@dataclass(frozen=True, kw_only=True)
class ListPeopleRequest(Request):
    """Nothing: all are listed."""


@dataclass(frozen=True, kw_only=True)
class PersonRequest(Request):
    """Which person."""

    name: str = argument("A person's name; `racecraft people list` has them all.", metavar="NAME")


@dataclass(frozen=True, kw_only=True)
class InviteRequest(Request):
    """Whom to invite."""

    name: str = argument("A name of 1 to 32 characters; left out with --csv.", "", metavar="[NAME]")
    role: str = option("racer", "What they may do.", choices=ROLES)
    csv: Path | None = option(None, "Invite everybody in this file: columns name and, if wanted, role.")
    preview: bool = option(False, "Only show what --csv would do.")
    address: str = option("", "Address of the console for the links. [default: this machine's name, port 8200]")


@dataclass(frozen=True, kw_only=True)
class ResetRequest(PersonRequest):
    """Whose password is chosen anew."""

    address: str = option("", "Address of the console for the link. [default: this machine's name, port 8200]")


@dataclass(frozen=True, kw_only=True)
class RoleRequest(PersonRequest):
    """Whose role becomes which."""

    role: str = argument("owner, organiser, racer or spectator.", metavar="ROLE")


@dataclass(frozen=True, kw_only=True)
class ShowLogRequest(Request):
    """How much of the log."""

    lines: int = option(50, "At most so many, the newest.", low=1, high=100_000)


@dataclass(frozen=True)
class ListedPerson:
    """A person as a list shows them."""

    name: str
    role: str
    has_password: bool
    """False: the invitation was not accepted yet."""
    created: float
    """Seconds since 1970."""
    id: str
    sessions: int
    """Browsers that are signed in."""


@dataclass(frozen=True)
class PersonList:
    """Everybody, by name."""

    people: list[ListedPerson]


@dataclass(frozen=True)
class Invitation:
    """A link for one person; it is shown here alone."""

    name: str
    role: str
    link: str
    """"": none, because of `wrong`, or because it is a preview."""
    wrong: str = ""
    """Why this line of the file invites nobody."""
    line: int = 0
    """Of the file; 0: none."""


@dataclass(frozen=True)
class Invitations:
    """Whom a command invited, or would."""

    invitations: list[Invitation]
    is_preview: bool = False


@dataclass(frozen=True)
class ChangedPerson:
    """A person after a change."""

    name: str
    change: str


@dataclass(frozen=True)
class LoggedAct:
    """One line of the log."""

    time: float
    """Seconds since 1970."""
    name: str
    what: str
    subject: str
    detail: dict[str, object]


@dataclass(frozen=True)
class ActLog:
    """What owners and organisers did, the newest first."""

    acts: list[LoggedAct]


@action
def list_people(request: ListPeopleRequest, progress: Progress = quiet) -> PersonList:
    """List everybody who was invited, with roles and sign-ins.

    Example: racecraft people list
    """
    from racecraft.accounts.sessions import Sessions

    with _accounts() as accounts:
        sessions = Sessions(accounts)
        return PersonList([
            ListedPerson(one.name, one.role.value, one.has_password, one.created, one.id, sessions.count(one))
            for one in accounts.people()
        ])  # fmt: skip


@action
def invite_people(request: InviteRequest, progress: Progress = quiet) -> Invitations:
    """Invite a person, or everybody in a CSV file: one link each, which works once and for 14 days.

    Behind the link a person chooses a password. Send each link to nobody else.

    Examples:

        racecraft people invite Ada --role organiser

        racecraft people invite --csv club.csv --preview
    """
    from racecraft.accounts.invitation_csv import Row, read_invitations
    from racecraft.accounts.invitations import invite
    from racecraft.accounts.people import LOCAL_OWNER, role_named
    from racecraft.contract.errors import InputFileError
    from racecraft.formats.user_file import read_user_text

    if bool(request.name) == (request.csv is not None):
        raise SettingError("invite: expected a name, or --csv FILE.")
    with _accounts() as accounts:
        if request.csv is None:
            rows = [Row(line=0, name=request.name, role=role_named(request.role))]
        else:
            rows = read_invitations(
                request.csv, read_user_text(request.csv, InputFileError, "a CSV file"), accounts.people()
            )
        made = []
        for row in rows:
            link = ""
            if not row.wrong and not request.preview:
                person, token = invite(accounts, LOCAL_OWNER, row.name, row.role)
                link = console_link(request.address, f"invitation/{token}")
            made.append(Invitation(row.name, row.role.value, link, row.wrong, row.line))
    return Invitations(made, request.preview)


@action
def set_role(request: RoleRequest, progress: Progress = quiet) -> ChangedPerson:
    """Give a person another role; a lower one signs them out everywhere.

    Example: racecraft people role Ada organiser
    """
    from racecraft.accounts.people import LOCAL_OWNER, role_named

    with _accounts() as accounts:
        person, role = accounts.named(request.name), role_named(request.role)
        accounts.set_role(person, role)
        accounts.log(LOCAL_OWNER, "change role", person.name, before=person.role.value, after=role.value)
    return ChangedPerson(person.name, f"{person.role.value} -> {role.value}")


@action
def remove_person(request: PersonRequest, progress: Progress = quiet) -> ChangedPerson:
    """Remove a person: no sign-in any more; models, runs and results stay.

    Example: racecraft people remove Ada
    """
    from racecraft.accounts.people import LOCAL_OWNER

    with _accounts() as accounts:
        person = accounts.named(request.name)
        accounts.remove(person)
        accounts.log(LOCAL_OWNER, "remove", person.name, id=person.id)
    return ChangedPerson(person.name, "removed")


@action
def reset_password(request: ResetRequest, progress: Progress = quiet) -> Invitations:
    """Make a new link for somebody who forgot the password, the owner's own account too.

    The old password holds until the link is used; then every session of that person ends.

    Example: racecraft people reset Ada
    """
    from racecraft.accounts.invitations import reset
    from racecraft.accounts.people import LOCAL_OWNER

    with _accounts() as accounts:
        person = accounts.named(request.name)
        link = console_link(request.address, f"invitation/{reset(accounts, LOCAL_OWNER, person)}")
    return Invitations([Invitation(person.name, person.role.value, link)])


@action
def sign_out_everywhere(request: PersonRequest, progress: Progress = quiet) -> ChangedPerson:
    """End every session of a person.

    Example: racecraft people sign-out Ada
    """
    from racecraft.accounts.people import LOCAL_OWNER
    from racecraft.accounts.sessions import Sessions

    with _accounts() as accounts:
        person = accounts.named(request.name)
        count = Sessions(accounts).end_all(person)
        accounts.log(LOCAL_OWNER, "sign out", person.name, sessions=count)
    return ChangedPerson(person.name, f"{count} session{'s' * (count != 1)} ended")


@action
def show_act_log(request: ShowLogRequest, progress: Progress = quiet) -> ActLog:
    """Show what owners and organisers did: invitations, roles, races, corrections.

    Example: racecraft people log --lines 10
    """
    with _accounts() as accounts:
        return ActLog([
            LoggedAct(one.time, one.name, one.what, one.subject, dict(one.detail))
            for one in accounts.acts(request.lines)
        ])  # fmt: skip


def log_act(what: str, subject: str, **detail: object) -> None:
    """Keep what the owner of this machine did by command, where people have accounts on it.

    Args:
        what: "close race", …
        subject: To what.
        detail: Further facts that JSON can hold.
    """
    from racecraft.jobs.job_paths import JobPaths

    if JobPaths.of_user().has_store:
        from racecraft.accounts.people import LOCAL_OWNER

        with _accounts() as accounts:
            if accounts.people():
                accounts.log(LOCAL_OWNER, what, subject, **detail)


@contextlib.contextmanager
def _accounts() -> Iterator[Accounts]:
    from racecraft.accounts.store import Accounts
    from racecraft.jobs.job_paths import JobPaths

    made = Accounts(JobPaths.of_user().store_url)
    try:
        yield made
    finally:
        made.close()


def console_link(address: str, path: str) -> str:
    """Return the link to a page of a console; without an address that of this machine, port 8200."""
    import socket

    return f"{(address or f'http://{socket.gethostname()}:8200').rstrip('/')}/{path}"
