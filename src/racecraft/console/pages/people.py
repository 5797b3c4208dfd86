"""Who shares the console: invitations, roles, and one's own account."""

from __future__ import annotations

import socket
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from racecraft.accounts.invitation_csv import read_invitations
from racecraft.accounts.invitations import invite, reset
from racecraft.accounts.people import LOCAL_OWNER, AccountError, Person, Role, role_named
from racecraft.accounts.rights import NotAllowedError, Verb, may, require_gives
from racecraft.accounts.sessions import Sessions
from racecraft.accounts.store import Accounts
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, form_fields, one, page_routes, person_of
from racecraft.contract.errors import SettingError, UserInputError
from racecraft.web.access import LOOPBACK_NAMES, SIGN_IN, set_cookie
from racecraft.web.errors import WebError

LOG_LINES = 50


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of people and of one's own account."""

    async def sign_out(request: Request) -> Response:
        await form_fields(request)
        _sessions(console).end(request.scope["racecraft.session"])
        return _left(request)

    async def sign_out_everywhere(request: Request) -> Response:
        await form_fields(request)
        _sessions(console).end_all(person_of(request))
        return _left(request)

    return [
        *page_routes(console, "/people", people_page),
        act_route(console, "/people/invite", invite_some),
        act_route(console, "/people/preview", preview),
        act_route(console, "/people/{id}/role", change_role),
        act_route(console, "/people/{id}/reset", reset_password),
        act_route(console, "/people/{id}/remove", remove),
        *page_routes(console, "/account", account_page),
        act_route(console, "/account/password", change_password),
        Route("/account/sign-out", sign_out, methods=["POST"]),
        Route("/account/sign-out-everywhere", sign_out_everywhere, methods=["POST"]),
    ]


def people_page(console: Console, request: Request) -> Page:
    """Return everybody, the forms that invite, and what owners and organisers did."""
    return _page(console, request)


def preview(console: Console, request: Request, fields: Fields) -> Page:
    """Show whom a CSV would invite; nobody is."""
    text = one(fields, "csv")
    try:
        rows = read_invitations(Path("CSV"), text, _accounts(console).people())
    except UserInputError as error:
        return _page(console, request, wrong=str(error), csv=text, status=422)
    checked = [
        {"line": row.line, "name": row.name, "role": row.role.value, "wrong": row.wrong or _refusal(request, row.role)}
        for row in rows
    ]
    return _page(console, request, preview=checked, csv=text)


def invite_some(console: Console, request: Request, fields: Fields) -> Page:
    """Invite one person, or everybody of a CSV that can be invited; the links are shown once."""
    person, accounts = person_of(request), _accounts(console)
    try:
        if text := one(fields, "csv"):
            rows = read_invitations(Path("CSV"), text, accounts.people())
            wanted = [(row.name, row.role) for row in rows if not row.wrong and not _refusal(request, row.role)]
        else:
            wanted = [(one(fields, "name"), role_named(one(fields, "role", "racer")))]
        links = []
        for name, role in wanted:
            made, token = invite(accounts, person, name, role)
            links.append(_link(request, made, token))
    except NotAllowedError as error:
        raise WebError(403, "not_allowed", str(error)) from error
    except UserInputError as error:
        return _page(console, request, wrong=str(error), status=422)
    return _page(console, request, links=links)


def reset_password(console: Console, request: Request, fields: Fields) -> Page:
    """Make a new link for somebody; the old password holds until it is used."""
    who = _who(console, request)
    try:
        token = reset(_accounts(console), person_of(request), who)
    except NotAllowedError as error:
        raise WebError(403, "not_allowed", str(error)) from error
    return _page(console, request, links=[_link(request, who, token)])


def change_role(console: Console, request: Request, fields: Fields) -> str:
    """Give somebody another role."""
    who, role, accounts = _who(console, request), role_named(one(fields, "role")), _accounts(console)
    accounts.set_role(who, role)
    accounts.log(person_of(request), "change role", who.name, before=who.role.value, after=role.value)
    return "/people"


def remove(console: Console, request: Request, fields: Fields) -> str:
    """Remove somebody whose name was typed once more; models and results stay."""
    who, accounts = _who(console, request), _accounts(console)
    if one(fields, "name").strip().casefold() != who.name.casefold():
        raise SettingError("Remove {name}: found {found!r}; expected the name, typed once more.",
                           name=who.name, found=one(fields, "name")[:40])  # fmt: skip
    accounts.remove(who)
    accounts.log(person_of(request), "remove", who.name, id=who.id)
    return "/people"


def account_page(console: Console, request: Request) -> Page:
    """Return who is signed in, where, and the form for another password."""
    return _account(console, request)


def change_password(console: Console, request: Request, fields: Fields) -> Page | Response:
    """Keep another password; every session ends, and this browser signs in anew."""
    person, accounts = person_of(request), _accounts(console)
    if person == LOCAL_OWNER:
        raise SettingError("The owner of the machine needs no password; expected somebody who was invited.")
    try:
        accounts.with_password(person.name, one(fields, "old"))
        if one(fields, "password") != one(fields, "again"):
            raise AccountError("The two new passwords differ; expected the same twice.")
        accounts.set_password(person, one(fields, "password"))
    except AccountError as error:
        return _account(console, request, str(error), 422)
    answer = RedirectResponse("/account", 303)
    set_cookie(request.scope, answer, _sessions(console).begin(person))
    return answer


def _account(console: Console, request: Request, wrong: str = "", status: int = 200) -> Page:
    person = person_of(request)
    data = {
        "name": person.name,
        "role": person.role.value,
        "is_local": person == LOCAL_OWNER,
        "sessions": _sessions(console).count(person),
        "verbs": [verb.value for verb in Verb if may(person, verb)],
        "wrong": wrong,
    }
    return Page("account.html", person.name, data, here="/account", status=status)


def _page(
    console: Console, request: Request, *, wrong: str = "", csv: str = "", status: int = 200,
    links: list[dict[str, str]] | None = None, preview: list[dict[str, Any]] | None = None,
) -> Page:  # fmt: skip
    person, accounts, sessions = person_of(request), _accounts(console), _sessions(console)
    people = [
        {
            "id": other.id,
            "name": other.name,
            "role": other.role.value,
            "has_password": other.has_password,
            "sessions": sessions.count(other),
            "can_reset": not _refusal(request, other.role),
        }
        for other in accounts.people()
    ]
    acts = [
        {"time": act.time, "name": act.name, "what": act.what, "subject": act.subject, "detail": dict(act.detail)}
        for act in accounts.acts(LOG_LINES)
    ]
    data = {
        "people": people,
        "roles": [role.value for role in Role],
        "given_roles": [role.value for role in Role if not _refusal(request, role)],
        "appoints": may(person, Verb.APPOINT),
        "is_local": request.url.hostname in LOOPBACK_NAMES,
        "acts": acts,
        "links": links or [],
        "preview": preview or [],
        "invitable": sum(not row["wrong"] for row in preview or []),
        "csv": csv,
        "wrong": wrong,
    }
    return Page("people.html", "People", data, here="/people", status=status)


def _link(request: Request, person: Person, token: str) -> dict[str, str]:
    """Return a link by the name under which others reach this server."""
    here = request.url.netloc
    if request.url.hostname in LOOPBACK_NAMES:
        here = f"{socket.gethostname()}:{request.url.port or 80}"
    address = f"{request.url.scheme}://{here}/invitation/{token}"
    return {"name": person.name, "role": person.role.value, "address": address}


def _refusal(request: Request, role: Role) -> str:
    """Return why whoever asks may not give a role; "": they may."""
    try:
        require_gives(person_of(request), role)
    except NotAllowedError as error:
        return str(error)
    return ""


def _who(console: Console, request: Request) -> Person:
    """Return the person that an address names.

    Raises:
        WebError: There is none.
    """
    found = _accounts(console).find(request.path_params["id"])
    if found is None or found == LOCAL_OWNER:
        raise WebError(404, "no_such_person", "There is no such person; load the page again.")
    return found


def _left(request: Request) -> Response:
    answer = RedirectResponse(SIGN_IN, 303)
    set_cookie(request.scope, answer, "")
    return answer


def _accounts(console: Console) -> Accounts:
    assert console.accounts is not None
    return console.accounts


def _sessions(console: Console) -> Sessions:
    return Sessions(_accounts(console))


SECTION = Section(routes=routes, label="People", href="/people", icon="people", order=60)
