"""Who may ask a server, as pure ASGI around all routes. Begin with `Access`.

ONLY_HERE          this machine: other names in the Host header (DNS rebinding) and other sites' pages are refused
opened(token)      other machines as well, with a token that is made at each start, stands in the printed address
                   and is exchanged for a cookie
signed_in(people)  the same, and people of a server's own who have signed in
ANYONE             whatever Host, whoever asks: webhooks, endpoints and metrics opened with --host
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
from dataclasses import dataclass, replace
from http.cookies import CookieError, SimpleCookie
from typing import Any, Protocol
from urllib.parse import parse_qsl, urlencode, urlsplit

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, Headers, MutableHeaders
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from racecraft.web.errors import WebError, error_answer
from racecraft.web.ports import is_loopback

SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})


class SignedIn(Protocol):
    """Whose request one is."""

    @property
    def person(self) -> Any:
        """Who asks, as the application knows people."""
        ...

    @property
    def session(self) -> str:
        """Names the session as long as it lasts."""
        ...

    @property
    def renewed(self) -> str:
        """The token that takes the place of the cookie's; "": that one stays."""
        ...


class Sessions(Protocol):
    """Knows who has signed in; `accounts.sessions` is one."""

    owner: Any
    """Who holds the token of the printed address."""

    def find(self, token: str) -> SignedIn | None:
        """Return whose token this is; None: nobody's. It is called in a thread."""
        ...


@dataclass(frozen=True)
class Access:
    """Who may ask."""

    hosts: frozenset[str] | None = LOOPBACK_NAMES
    """Names that may stand in the Host header, without port; None: any."""
    token: str = ""
    """What has to be shown, as `?token=`, as a Bearer or as the cookie; "": nothing."""
    pages: bool = True
    """Whether browsers are expected: requests that other sites' pages send are refused."""
    sessions: Sessions | None = None
    """Who has signed in; None: there is no signing in."""
    open_paths: tuple[str, ...] = ()
    """What those who have not signed in may ask for: paths, or beginnings of paths where they end in "/"."""


NOT_SIGNED_IN, STRANGER = "not_signed_in", "stranger-"
"""The error of somebody who has to sign in first, and how the cookie begins that their forms are checked by."""
SIGN_IN = "/sign-in"
"""Where somebody is led who has to sign in first."""

ONLY_HERE = Access()
ANYONE = Access(hosts=None, pages=False)


def opened(token: str = "") -> Access:
    """Return access for other machines; by default with a new token."""
    return Access(hosts=None, token=token or secrets.token_urlsafe(24))


def signed_in(access: Access, sessions: Sessions, open_paths: tuple[str, ...]) -> Access:
    """Return access that also lets those in who have signed in.

    Args:
        access: From `opened`.
        sessions: Who has.
        open_paths: As `Access.open_paths`; SIGN_IN has to be among them.
    """
    return replace(access, sessions=sessions, open_paths=open_paths)


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
        self._form_secret = secrets.token_bytes(32)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        try:
            self._check_host(headers)
            self._check_site(scope, headers)
            exchange = self._exchanged(scope, headers)
            found = None if exchange else await self._visitor(scope, headers)
        except WebError as error:
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008, "reason": error.name})
                return
            answer: Response = error_answer(Request(scope), error.status, error.name, error.sentence)
            if error.name == NOT_SIGNED_IN and "text/html" in headers.get("accept", ""):
                answer = RedirectResponse(f"{SIGN_IN}?{urlencode({'next': _requested_page(scope)})}", 303)
            await answer(scope, receive, send)
            return
        if exchange is not None:
            await exchange(scope, receive, send)
            return
        assert found is not None
        scope["racecraft.person"], scope["racecraft.session"] = found.person, found.session
        scope["racecraft.form_token"] = self._form_token(found.session)
        await self._app(scope, receive, _with_cookie(scope, send, found.cookie) if found.cookie else send)

    def _form_token(self, session: str) -> str:
        """Return what every form of a session's pages carries."""
        return hmac.digest(self._form_secret, session.encode(), hashlib.sha256).hex()

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

    def _exchanged(self, scope: Scope, headers: Headers) -> RedirectResponse | None:
        """Return the answer that exchanges the printed token for a cookie; None where none is shown."""
        query = dict(parse_qsl(scope["query_string"].decode("latin-1")))
        token = query.pop("token", "")
        if not (token and scope["type"] == "http" and scope["method"] == "GET" and _equal(token, self._access.token)):
            return None
        answer = RedirectResponse("/" + scope["path"].lstrip("/") + (f"?{urlencode(query)}" if query else ""), 303)
        set_cookie(scope, answer, self._session)
        return answer

    async def _visitor(self, scope: Scope, headers: Headers) -> _Visitor:
        """Return who asks.

        Raises:
            WebError: Nobody who may.
        """
        sessions, token = self._access.sessions, _cookie(headers, _cookie_name(scope))
        owner = sessions.owner if sessions else None
        bearer = headers.get("authorization", "").removeprefix("Bearer ")
        if not self._access.token or _equal(token, self._session) or _equal(bearer, self._access.token):
            return _Visitor(owner, self._session)
        if sessions is None:
            raise WebError(
                401,
                "no_token",
                "open the address with ?token=… that the terminal printed; it changes with every start.",
            )
        found = await run_in_threadpool(sessions.find, token) if token else None
        if found is not None:
            return _Visitor(found.person, found.session, found.renewed)
        if not self._is_open(scope["path"]):
            raise WebError(401, NOT_SIGNED_IN, f"sign in first, at {SIGN_IN}.")
        if token.startswith(STRANGER) and len(token) < 80:
            return _Visitor(None, token)
        stranger = STRANGER + secrets.token_urlsafe(24)
        # Only a page that somebody goes to has a form whose cookie this is. What other pages still load without a
        # cookie is answered any time, after that page as well, and would take the place of its cookie.
        goes_there = headers.get("sec-fetch-mode", "navigate") == "navigate"
        return _Visitor(None, stranger, stranger if goes_there else "")

    def _is_open(self, path: str) -> bool:
        return any(path.startswith(one) if one.endswith("/") else path == one for one in self._access.open_paths)


@dataclass(frozen=True)
class _Visitor:
    """Who asks."""

    person: Any
    """None: nobody who has signed in, or a server without people."""
    session: str
    cookie: str = ""
    """What the browser is to keep from now on; "": what it has."""


def set_cookie(scope: Scope, answer: Response, token: str) -> None:
    """Have the browser keep a session's token; "": forget it."""
    options: dict[str, Any] = {"httponly": True, "samesite": "lax", "secure": scope.get("scheme") in ("https", "wss")}
    if token:
        answer.set_cookie(_cookie_name(scope), token, **options)
    else:
        answer.delete_cookie(_cookie_name(scope), **options)


def _with_cookie(scope: Scope, send: Send, token: str) -> Send:
    """Return a `send` that has the browser keep a token, unless the answer sets the cookie itself."""

    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            kept = MutableHeaders(scope=message)
            if not any(one.startswith(f"{_cookie_name(scope)}=") for one in kept.getlist("set-cookie")):
                cookie = Response()
                set_cookie(scope, cookie, token)
                kept.append("set-cookie", cookie.headers["set-cookie"])
        await send(message)

    return sent


def _requested_page(scope: Scope) -> str:
    """Return the path and the words of a request that only reads; of another "/"."""
    if scope["method"] not in SAFE_METHODS:
        return "/"
    query = scope["query_string"].decode("latin-1")
    return f"/{scope['path'].lstrip('/')}" + (f"?{query}" if query else "")


def checked_fields(request: Request, form: FormData) -> dict[str, list[str]]:
    """Return the text values of a form that one of our pages sent, by field.

    Raises:
        WebError: The form lacks the token that our pages put in (form_token), so that it came from elsewhere.
    """
    fields: dict[str, list[str]] = {}
    for name, value in form.multi_items():
        if isinstance(value, str):
            fields.setdefault(name, []).append(value)
    token = fields.pop("form_token", [""])[0]
    if not _equal(token, request.scope.get("racecraft.form_token", "")):
        raise WebError(
            403, "forged_form", "the form lacks its page's token; load the page again and send it once more."
        )
    return fields


def _equal(given: str, right: str) -> bool:
    return bool(right) and hmac.compare_digest(given.encode(), right.encode())


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
