"""The console's pages and what answers for them. Begin with `make_console`."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator, Sequence
from pathlib import Path

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from racecraft.console.index import Index
from racecraft.console.pages import compare, create, garage, imports, jobs, kept, model, settings
from racecraft.console.parts import parts_of
from racecraft.console.section import Section
from racecraft.console.service import Console
from racecraft.console.watcher import Watcher
from racecraft.console.workspace import Workspace
from racecraft.contract.errors import RacecraftError
from racecraft.contract.kinds import kinds
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.preload import keep_warm
from racecraft.web.access import ONLY_HERE, Access
from racecraft.web.application import make_application
from racecraft.web.push import events_answer

MOST_UPLOAD_BYTES = 4 * 1024**3
SECTIONS: tuple[Section, ...] = (
    garage.SECTION,
    compare.SECTION,
    create.SECTION,
    imports.SECTION,
    jobs.SECTION,
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
    workspace = Workspace.open(folder)
    index, home = Index(workspace, database or None), home or JobPaths.of_user()
    watcher = Watcher(index, home)
    sections = [*(one for kind in kinds() for one in parts_of(kind.name).sections()), *SECTIONS]
    entries = sorted((one for one in sections if one.label), key=lambda one: one.order)
    console = Console(workspace, index, watcher, home, tuple(entries))
    watcher.told = lambda names: console.news.publish({"changed": names, "version": index.version})
    made = make_application(_routes(console, sections), access, most_body={"/import": MOST_UPLOAD_BYTES})
    made.router.lifespan_context = lambda app: _running(console)
    made.state.console = console
    return made


@contextlib.asynccontextmanager
async def _running(console: Console) -> AsyncIterator[None]:
    console.watcher.start()
    stack = contextlib.ExitStack()
    with contextlib.suppress(OSError, RacecraftError):  # without a warm worker trainings begin later, and begin
        stack.enter_context(keep_warm(console.home))
    try:
        yield
    finally:
        stack.close()
        console.watcher.close()
        console.index.close()


def _routes(console: Console, sections: Sequence[Section]) -> list[BaseRoute]:
    def picture(request: Request) -> Response:
        kind, key = request.path_params["kind"], request.path_params["key"]
        svg = parts_of(kind).picture(key)
        return Response(svg, media_type="image/svg+xml", headers={"Cache-Control": "public, max-age=86400"})

    async def events(request: Request) -> Response:
        return events_answer(request, [console.news])

    return [
        *(route for section in sections for route in section.routes(console)),
        Route("/pictures/{kind}/{key}.svg", picture),
        Route("/events", events),
    ]
