"""A console for each person: whoever asks is answered from their own workspace. Begin with `PersonalConsoles`.

Nobody reaches another's models, drafts, jobs or files, because no page of a person's console knows of them; which pages
a role may open is one table (`rights.py`).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.routing import BaseRoute, Match, Route
from starlette.types import Receive, Scope, Send

from racecraft.accounts.people import LOCAL_OWNER, Person
from racecraft.accounts.rights import NotAllowedError, require
from racecraft.console.rights import verb_of
from racecraft.console.service import Console
from racecraft.console.workspace import PEOPLE
from racecraft.contract.loading import refuses_own_code
from racecraft.web.access import NOT_SIGNED_IN
from racecraft.web.errors import WebError


def workspace_of(root: Path, person: Person) -> Path:
    """Return the folder of a person's workspace, which need not exist; `root` is every owner's."""
    return root / PEOPLE / f"{person.name}-{person.id}" if person.owned else root


@dataclass(frozen=True)
class _Pages:
    console: Console
    routes: Sequence[BaseRoute]


class PersonalConsoles:
    """Answers every request by the console of the person who asks.

    Args:
        open_console: Returns the console of a person, by `Person.owned`: "" for every owner.
        routes: Returns the routes of a console.
    """

    def __init__(
        self, open_console: Callable[[Person], Console], routes: Callable[[Console], Sequence[BaseRoute]]
    ) -> None:
        self._open, self._routes = open_console, routes
        self._lock = threading.Lock()
        self._pages: dict[str, _Pages] = {}
        self.owner = self._of(LOCAL_OWNER).console

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        person: Person | None = scope.get("racecraft.person")
        if person is None:
            raise WebError(401, NOT_SIGNED_IN, "sign in first.")
        pages = self._pages.get(person.owned)
        if pages is None:
            pages = await run_in_threadpool(self._of, person)
        route, matched = _match(pages.routes, scope)
        try:  # a WebSocket acts
            require(person, verb_of(str(getattr(route, "path", "")), scope.get("method", "WEBSOCKET")))
        except NotAllowedError as error:
            if scope["type"] == "websocket":
                await send({"type": "websocket.close", "code": 1008, "reason": "not_allowed"})
                return
            raise WebError(403, "not_allowed", str(error)) from error
        refuses_own_code.set(bool(person.owned))
        scope.update(matched)
        await route.handle(scope, receive, send)

    def close(self) -> None:
        """Close all consoles but the owner's."""
        with self._lock:
            for owned, pages in self._pages.items():
                if owned:
                    pages.console.close()

    def _of(self, person: Person) -> _Pages:
        with self._lock:
            found = self._pages.get(person.owned)
            if found is None:
                console = self._open(person)
                if person.owned:
                    console.watcher.start()
                found = self._pages[person.owned] = _Pages(console, self._routes(console))
        return found


def _match(routes: Sequence[BaseRoute], scope: Scope) -> tuple[BaseRoute, Scope]:
    """Return the route of a request, and what it adds to the scope.

    Raises:
        HTTPException: There is none (404), or only one for other methods (405).
    """
    others = False
    for route in routes:
        match, matched = route.matches(scope)
        if match is Match.FULL:
            return route, dict(matched)
        others = others or (match is Match.PARTIAL and isinstance(route, Route))
    raise HTTPException(405 if others else 404)
