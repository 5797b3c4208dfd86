"""The console's pages and what answers for them. Begin with `make_console`."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Mount, Route

from racecraft.accounts.people import Person
from racecraft.accounts.sessions import Sessions
from racecraft.accounts.store import Accounts
from racecraft.console.helper import Helper
from racecraft.console.index import Index
from racecraft.console.pages import (
    compare,
    create,
    endpoints,
    garage,
    imports,
    jobs,
    kept,
    lessons,
    model,
    people,
    race_drive,
    race_making,
    racer,
    races,
    settings,
    shared,
    show,
    sign_in,
    tuning,
)
from racecraft.console.parts import parts_of
from racecraft.console.personal import PersonalConsoles, workspace_of
from racecraft.console.race_watch import LOOK_SECONDS, RaceWatch
from racecraft.console.section import Section
from racecraft.console.service import Console
from racecraft.console.tasks import Tasks
from racecraft.console.watcher import Watcher
from racecraft.console.workspace import LEAGUE, Workspace
from racecraft.contract.errors import RacecraftError
from racecraft.contract.kinds import kinds
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.preload import keep_warm
from racecraft.web.access import ONLY_HERE, Access, signed_in
from racecraft.web.application import make_application
from racecraft.web.push import Topic, events_answer

MAX_UPLOAD_BYTES = 4 * 1024**3
COMMANDS_AT_ONCE = 1
"""That pages ask for and that take long; others wait, so that trainings are not slowed by many."""
SECTIONS: tuple[Section, ...] = (
    garage.SECTION,
    compare.SECTION,
    create.SECTION,
    imports.SECTION,
    racer.SECTION,
    show.SECTION,
    shared.SECTION,
    race_making.SECTION,
    race_drive.SECTION,
    races.SECTION,
    people.SECTION,
    lessons.SECTION,
    jobs.SECTION,
    endpoints.SECTION,
    tuning.SECTION,
    settings.SECTION,
    kept.SECTION,
    model.SECTION,
)
"""Whose routes are asked in this order, behind those of the worlds."""


def make_console(
    folder: Path, home: JobPaths | None = None, access: Access = ONLY_HERE, database: str = ""
) -> Starlette:
    """Return the application of a workspace; its watcher starts and ends with it.

    Args:
        folder: The workspace; made where there is none.
        home: Where jobs are; None: this account's.
        access: Who may ask.
        database: SQLAlchemy's address of the index; "": a SQLite file in the workspace.

    Raises:
        OutputFileError: The folder cannot be made.
        DatabaseError: The index cannot be written.
    """
    home, root = home or JobPaths.of_user(), Workspace.open(folder)
    accounts = Accounts(home.store_url)
    sections = [*(one for kind in kinds() for one in parts_of(kind.name).sections()), *SECTIONS]
    entries = tuple(sorted((one for one in sections if one.label), key=lambda one: one.order))
    helper, workers = Helper(), ThreadPoolExecutor(COMMANDS_AT_ONCE, thread_name_prefix="racecraft-console-task")

    watch = RaceWatch(root.path / LEAGUE)
    races, drives = Topic("races", watch.changed, LOOK_SECONDS), Topic("drives", watch.driving, LOOK_SECONDS)

    def open_console(person: Person) -> Console:
        workspace = Workspace.open(workspace_of(root.path, person)) if person.owned else root
        index = Index(workspace, None if person.owned else database or None)
        own_home = replace(home, person=person.owned)
        watcher = Watcher(index, own_home)
        console = Console(
            workspace, index, watcher, own_home, entries, accounts, root.path, races, drives, helper=helper
        )
        console.tasks = Tasks(lambda name: console.news.publish({"changed": [name], "version": index.version}), workers)
        watcher.told = lambda names: console.news.publish({"changed": names, "version": index.version})
        return console

    consoles = PersonalConsoles(open_console, lambda console: _routes(console, sections))
    sessions = Sessions(accounts)
    made = make_application(
        [*sign_in.routes(accounts, sessions), *show.screen_routes(consoles.owner), Mount("", consoles)],
        signed_in(access, sessions, (*sign_in.OPEN_PATHS, show.SCREEN)),
        most_body={"/import": MAX_UPLOAD_BYTES, "/settings/restore": MAX_UPLOAD_BYTES},
    )
    made.router.lifespan_context = lambda app: _running(consoles, accounts)
    made.state.console = consoles.owner
    return made


@contextlib.asynccontextmanager
async def _running(consoles: PersonalConsoles, accounts: Accounts) -> AsyncIterator[None]:
    console = consoles.owner
    console.watcher.start()
    stack = contextlib.ExitStack()
    with contextlib.suppress(OSError, RacecraftError):  # without a warm worker trainings begin later, and begin
        stack.enter_context(keep_warm(console.home))
    try:
        yield
    finally:
        stack.close()
        consoles.close()
        console.close()
        console.helper.close()
        accounts.close()


def _routes(console: Console, sections: Sequence[Section]) -> list[BaseRoute]:
    def picture(request: Request) -> Response:
        kind, key = request.path_params["kind"], request.path_params["key"]
        svg = parts_of(kind).picture(key)
        return Response(svg, media_type="image/svg+xml", headers={"Cache-Control": "public, max-age=86400"})

    async def events(request: Request) -> Response:
        return events_answer(request, [console.news, console.races, console.drives])

    return [
        *(route for section in sections for route in section.routes(console)),
        Route("/pictures/{kind}/{key}.svg", picture),
        Route("/events", events),
    ]
