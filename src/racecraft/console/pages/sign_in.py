"""Sign in, and choose a password behind the link of an invitation: what people see before they have signed in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from racecraft.accounts.attempts import Attempts
from racecraft.accounts.invitations import accept, invited
from racecraft.accounts.people import AccountError, Person, name_key
from racecraft.accounts.sessions import Sessions
from racecraft.accounts.store import Accounts
from racecraft.console.rights import may_open
from racecraft.console.service import TEMPLATES, form_fields, one
from racecraft.pages.assets import PREFIX
from racecraft.web.access import SIGN_IN, set_cookie
from racecraft.web.answers import page_answer

INVITATION = "/invitation/"
OPEN_PATHS = (SIGN_IN, INVITATION, PREFIX)
MAX_OF_AN_ADDRESS, MAX_OF_A_NAME = 30, 10
"""Attempts within a minute: of one address on any names, and on one name."""


def routes(accounts: Accounts, sessions: Sessions) -> list[BaseRoute]:
    """Return the routes that need no sign-in."""
    by_address, by_name = Attempts(MAX_OF_AN_ADDRESS), Attempts(MAX_OF_A_NAME)

    def form(request: Request) -> Response:
        return _sign_in_page(request, "", "", _inside(request.query_params.get("next", "/")))

    def sign_in(request: Request, fields: Any) -> Response:
        name, then = one(fields, "name"), _inside(one(fields, "next", "/"))
        where, who = _address(request), f"{_address(request)} {name_key(name[:128])}"
        try:
            by_address.count(where)
            by_name.count(who)
            person = accounts.with_password(name, one(fields, "password"))
        except AccountError as error:
            return _sign_in_page(request, str(error), name[:64], then, 403)
        by_name.clear(who)
        return _signed_in(request, sessions, person, then)

    def invitation(request: Request) -> Response:
        try:
            by_address.count(_address(request))
            person = invited(accounts, request.path_params["token"])
        except AccountError as error:
            return _invitation_page(request, None, str(error), 404)
        return _invitation_page(request, person, "")

    def take_invitation(request: Request, fields: Any) -> Response:
        token, password = request.path_params["token"], one(fields, "password")
        try:
            by_address.count(_address(request))
            person = invited(accounts, token)
        except AccountError as error:
            return _invitation_page(request, None, str(error), 404)
        if password != one(fields, "again"):
            return _invitation_page(request, person, "The two passwords differ; expected the same twice.", 422)
        try:
            accept(accounts, token, password)
        except AccountError as error:
            return _invitation_page(request, person, str(error), 422)
        return _signed_in(request, sessions, person, "/")

    return [
        Route(SIGN_IN, form),
        Route(SIGN_IN, _taking(sign_in), methods=["POST"]),
        Route(INVITATION + "{token}", invitation),
        Route(INVITATION + "{token}", _taking(take_invitation), methods=["POST"]),
    ]


def _taking(act: Callable[[Request, Any], Response]) -> Callable[[Request], Any]:
    async def take(request: Request) -> Response:
        fields = await form_fields(request)
        return await run_in_threadpool(act, request, fields)

    return take


def _signed_in(request: Request, sessions: Sessions, person: Person, then: str) -> Response:
    """Return the answer that signs somebody in: with a new token, whatever the browser held before."""
    if then == "/" and not may_open(person, "/"):
        then = "/account"
    answer = RedirectResponse(then, 303)
    set_cookie(request.scope, answer, sessions.begin(person))
    return answer


def _inside(address: str) -> str:
    r"""Return an address if it is a path of this server, "/" otherwise.

    >>> _inside("/models?q=a"), _inside("//evil.example"), _inside("https://evil.example"), _inside("/\\evil.example")
    ('/models?q=a', '/', '/', '/')
    """
    is_path = address.startswith("/") and not address.startswith(("//", "/\\"))
    return address if is_path and address.isprintable() and "\\" not in address else "/"


def _address(request: Request) -> str:
    return request.client.host if request.client else ""


def _sign_in_page(request: Request, wrong: str, name: str, then: str, status: int = 200) -> Response:
    data: dict[str, Any] = {"title": "Sign in", "wrong": wrong, "name": name, "then": then}
    return page_answer(request, f"{TEMPLATES}/sign_in.html", status=status, **data)


def _invitation_page(request: Request, person: Person | None, wrong: str, status: int = 200) -> Response:
    data: dict[str, Any] = {"title": "Choose a password", "person": person, "wrong": wrong, "path": request.url.path}
    return page_answer(request, f"{TEMPLATES}/invitation.html", status=status, **data)
