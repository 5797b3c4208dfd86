"""Who may ask a server, as pure ASGI around all routes. Begin with `Access`.

ONLY_HERE          this machine: other names in the Host header (DNS rebinding) and other sites' pages are refused
opened(token)      other machines as well, with a token that is made at each start, stands in the printed address
                   and is exchanged for a cookie
ANYONE             whatever Host, whoever asks: webhooks, endpoints and metrics opened with --host
"""

from __future__ import annotations

import hmac
import secrets
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qsl, urlencode, urlsplit

from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from racecraft.web.errors import WebError, error_answer
from racecraft.web.ports import is_loopback

SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})


@dataclass(frozen=True)
class Access:
    """Who may ask."""

    hosts: frozenset[str] | None = LOOPBACK_NAMES
    """Names that may stand in the Host header, without port; None: any."""
    token: str = ""
    """What has to be shown, as `?token=`, as a Bearer or as the cookie; "": nothing."""
    pages: bool = True
    """Whether browsers are expected: requests that other sites' pages send are refused."""


ONLY_HERE = Access()
ANYONE = Access(hosts=None, pages=False)


def opened(token: str = "") -> Access:
    """Return access for other machines; by default with a new token."""
    return Access(hosts=None, token=token or secrets.token_urlsafe(24))


def access_for(host: str) -> Access:
    """Return what a page's server needs at an address: nothing more on this machine, a token elsewhere."""
    return ONLY_HERE if is_loopback(host) else opened()


class Guard:
    """Lets through who may ask; everybody else gets 401 or 403 with a reason.

    Args:
        app: What is guarded.
        access: Who may ask.
    """

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self._app, self._access = app, access
        self._session = secrets.token_urlsafe(24)
        self._form_token = secrets.token_urlsafe(24)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        try:
            self._check_host(headers)
            self._check_site(scope, headers)
            exchange = self._check_token(scope, headers)
        except WebError as error:
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008, "reason": error.name})
                return
            answer = error_answer(Request(scope), error.status, error.name, error.sentence)
            await answer(scope, receive, send)
            return
        if exchange is not None:
            await exchange(scope, receive, send)
            return
        scope["racecraft.form_token"] = self._form_token
        await self._app(scope, receive, send)

    def _check_host(self, headers: Headers) -> None:
        named = headers.get("host", "")
        if self._access.hosts is not None and _name(named) not in self._access.hosts:
            raise WebError(
                403, "foreign_host",
                f"found the host {named[:80]!r}; this server answers {', '.join(sorted(self._access.hosts))} only. "
                "Start it with --host to open it to other machines.",
            )  # fmt: skip

    def _check_site(self, scope: Scope, headers: Headers) -> None:
        if not self._access.pages:
            return
        site, mode = headers.get("sec-fetch-site", ""), headers.get("sec-fetch-mode", "")
        changes = scope["type"] == "websocket" or scope["method"] not in SAFE_METHODS
        foreign = site in ("cross-site", "same-site") and (changes or mode != "navigate")
        origin = headers.get("origin")
        if changes and origin is not None and urlsplit(origin).netloc != headers.get("host", ""):
            foreign = True
        if foreign:
            whose = origin or headers.get("referer", "") or "another site"
            raise WebError(403, "foreign_site", f"a page of {whose[:80]} asked; only pages of this server may.")

    def _check_token(self, scope: Scope, headers: Headers) -> RedirectResponse | None:
        """Return the answer that exchanges a token for a cookie; None where nothing is to be exchanged."""
        if not self._access.token:
            return None
        query = dict(parse_qsl(scope["query_string"].decode("latin-1")))
        shown = query.pop("token", "")
        if shown and scope["type"] == "http" and scope["method"] == "GET" and _equal(shown, self._access.token):
            answer = RedirectResponse("/" + scope["path"].lstrip("/") + (f"?{urlencode(query)}" if query else ""), 303)
            answer.set_cookie(_cookie_name(scope), self._session, httponly=True, samesite="lax")
            return answer
        bearer = headers.get("authorization", "").removeprefix("Bearer ")
        if _equal(_cookie(headers, _cookie_name(scope)), self._session) or _equal(bearer, self._access.token):
            return None
        raise WebError(
            401, "no_token", "open the address with ?token=… that the terminal printed; it changes with every start."
        )


async def checked_form(request: Request) -> dict[str, str]:
    """Return the text fields of a form that one of our pages sent.

    Raises:
        WebError: The form lacks the token that our pages put in (form_token), so that it came from elsewhere.
    """
    async with request.form(max_files=0) as form:
        fields = {name: value for name, value in form.items() if isinstance(value, str)}
    token = fields.pop("form_token", "")
    if not _equal(token, request.scope.get("racecraft.form_token", "")):
        raise WebError(
            403, "forged_form", "the form lacks its page's token; load the page again and send it once more."
        )
    return fields


def _equal(shown: str, right: str) -> bool:
    return bool(right) and hmac.compare_digest(shown.encode(), right.encode())


def _name(host: str) -> str:
    """Return a Host header without its port, in small letters.

    >>> _name("LocalHost:8100"), _name("[::1]:8100"), _name("127.0.0.1")
    ('localhost', '::1', '127.0.0.1')
    """
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _cookie_name(scope: Scope) -> str:
    """Return a name of our own for each port: browsers give a host's cookies to all its ports."""
    server = scope.get("server")
    return f"racecraft-{server[1] if server else 0}"


def _cookie(headers: Headers, name: str) -> str:
    try:
        found = SimpleCookie(headers.get("cookie", "")).get(name)
    except CookieError:
        return ""
    return found.value if found else ""
