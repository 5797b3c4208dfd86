"""What every page of the console has at hand, and what a page is. Begin with `Console`."""

from __future__ import annotations

import contextlib
import time
from collections.abc import AsyncIterator, Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil
import sqlalchemy as sql
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import Route

from racecraft.accounts.people import LOCAL_OWNER, Person
from racecraft.accounts.store import Accounts
from racecraft.console.helper import Helper
from racecraft.console.index import Index
from racecraft.console.index_tables import MODELS
from racecraft.console.model_row import QUEUED, STOPPING, TRAINING
from racecraft.console.parts import Look
from racecraft.console.rights import may_open
from racecraft.console.section import Section
from racecraft.console.tasks import Tasks
from racecraft.console.watcher import Watcher
from racecraft.console.workspace import LEAGUE, Workspace
from racecraft.jobs.job_paths import JobPaths
from racecraft.web.access import checked_fields
from racecraft.web.answers import json_answer, page_answer
from racecraft.web.push import Topic

TEMPLATES = "racecraft.console"
Fields = Mapping[str, list[str]]
"""What a form sent: every value of each field."""


@dataclass(frozen=True)
class Page:
    """A page as plain data: a template draws it, `.json` behind its path shows it."""

    template: str
    title: str
    data: Mapping[str, Any]
    here: str = "/"
    """Which entry of the side bar it belongs to."""
    status: int = 200


@dataclass
class Console:
    """The workspace, its index, and who keeps it current."""

    workspace: Workspace
    index: Index
    watcher: Watcher
    home: JobPaths
    entries: tuple[Section, ...] = ()
    """Of the side bar, in order."""
    accounts: Accounts | None = None
    """Everybody's; None: the console of a test."""
    shared: Path | None = None
    """The owner's workspace, in which races lie that all people see; None: this one."""
    races: Topic = field(default_factory=lambda: Topic("races"))
    """Ids of the races whose entries or results changed."""
    drives: Topic = field(default_factory=lambda: Topic("drives"))
    """What is driven now, by race."""
    news: Topic = field(default_factory=lambda: Topic("models"))
    """Names of the models whose rows changed."""
    tasks: Tasks = field(default_factory=Tasks)
    helper: Helper = field(default_factory=Helper)

    def close(self) -> None:
        """End its watcher and what its pages asked for, and let go of its index."""
        self.tasks.close()
        self.watcher.close()
        self.index.close()

    @property
    def league(self) -> Path:
        """The folder of the races, which all people of this console share; it need not exist."""
        return (self.shared or self.workspace.path) / LEAGUE

    def machine(self) -> str:
        """Return what this machine does now, for the side bar."""
        counts = self.counts()
        training, waiting = counts.get(TRAINING, 0) + counts.get(STOPPING, 0), counts.get(QUEUED, 0)
        load = f"{psutil.cpu_count() or 1} cores, load {psutil.getloadavg()[0]:.1f}"
        if not training and not waiting:
            return f"Nothing trains · {load}"
        return f"{training} training" + (f", {waiting} waiting" if waiting else "") + f" · {load}"

    def counts(self) -> dict[str, int]:
        """Return how many models there are of each status, archived ones left out."""
        counted = sql.select(MODELS.c.status, sql.func.count().label("n")).where(MODELS.c.archived.is_(False))
        return {row["status"]: row["n"] for row in self.index.query(counted.group_by(MODELS.c.status))}


Answer = Callable[[Console, Request], Page | Response]
Act = Callable[[Console, Request, Fields], Page | Response | str]
"""Does what a form asks; returns the address that is shown next, or a page."""


def page_routes(console: Console, path: str, answer: Answer) -> list[Route]:
    """Return the routes of a page and of its data (`.json`)."""

    def as_page(request: Request) -> Response:
        return in_frame(console, request, answer(console, request))

    def as_json(request: Request) -> Response:
        page = answer(console, request)
        return json_answer(page.data, page.status) if isinstance(page, Page) else page

    return [Route("/index.json" if path == "/" else f"{path}.json", as_json), Route(path, as_page)]


def act_route(console: Console, path: str, act: Act) -> Route:
    """Return the route of a form."""

    async def take(request: Request) -> Response:
        fields = await form_fields(request)
        done = await run_in_threadpool(act, console, request, fields)
        if isinstance(done, str):
            return RedirectResponse(done, 303)
        return await run_in_threadpool(in_frame, console, request, done)

    return Route(path, take, methods=["POST"])


def in_frame(console: Console, request: Request, page: Page | Response) -> Response:
    """Return a page in the console's frame."""
    if isinstance(page, Response):
        return page
    person = person_of(request)
    menu = [
        {"label": one.label, "href": one.href, "icon": one.icon, "here": page.here == one.href}
        for one in console.entries
        if may_open(person, one.href)
    ]
    if person is not LOCAL_OWNER:
        menu.append({"label": person.name, "href": "/account", "icon": "people", "here": page.here == "/account"})
    return page_answer(
        request,
        f"{TEMPLATES}/{page.template}" if "/" not in page.template else page.template,
        status=page.status,
        title=page.title,
        menu=menu,
        machine=console.machine(),
        now=time.time(),
        fault=console.watcher.fault,
        **page.data,
    )


def person_of(request: Request) -> Person:
    """Return who asks; on the machine itself its owner."""
    person: Person = request.scope["racecraft.person"]
    return person


def looked(console: Console, request: Request, look: Look | None) -> Response:
    """Return the piece of a page that a closer look comes to; an empty one where there is nothing to look at."""
    if look is None:
        return Response("", media_type="text/html")
    answer = console.helper.ask(look.function, *look.arguments)
    return page_answer(request, look.template, **answer)


async def form_fields(request: Request) -> dict[str, list[str]]:
    """Return every text value of a form that one of our pages sent.

    Raises:
        WebError: The form lacks its page's token, so that it came from elsewhere.
    """
    async with request.form(max_files=0) as form:
        return checked_fields(request, form)


@contextlib.asynccontextmanager
async def form_with_file(request: Request, name: str) -> AsyncIterator[tuple[dict[str, list[str]], UploadFile | None]]:
    """Yield the text values of a form that one of our pages sent, and its file; None: it has none.

    Args:
        request: What is answered.
        name: The file's field.

    Raises:
        WebError: As from `form_fields`.
    """
    async with request.form(max_files=1) as form:
        fields, file = checked_fields(request, form), form.get(name)
        yield fields, file if isinstance(file, UploadFile) and file.filename else None


def one(fields: Fields, name: str, default: str = "") -> str:
    """Return the last value of a field."""
    return fields[name][-1] if fields.get(name) else default
