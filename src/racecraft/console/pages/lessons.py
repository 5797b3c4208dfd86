"""The course in the console; each person's progress lies with their own models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute

from racecraft.console.section import Section
from racecraft.console.service import Console, Page, in_frame
from racecraft.lessons.progress import Progress
from racecraft.lessons.service import STYLES, Lessons, lesson_routes


def routes(console: Console) -> Sequence[BaseRoute]:
    """Return the routes of the course; the owner shares one record with `racecraft lessons`."""
    own = console.workspace.path / "lessons.json" if console.home.person else None

    def frame(request: Request, template: str, title: str, **data: Any) -> Response:
        return in_frame(console, request, Page(template, title, {"styles": STYLES} | data, here="/lessons"))

    return lesson_routes(Lessons(frame, Progress(own), models=console.workspace.newest_runs))


SECTION = Section(routes=routes, label="Lessons", href="/lessons", icon="book", order=30)
