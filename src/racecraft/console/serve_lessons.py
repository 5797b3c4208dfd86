"""Serve the course."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.actions.served_pages import ServedPages, listen
from racecraft.actions.watch import HOST_HELP, port_help
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, option

PORT = 8300


@dataclass(frozen=True, kw_only=True)
class LessonsRequest(Request):
    """Where the pages of the course are."""

    port: int | None = option(None, port_help(PORT), low=0, high=65535)
    host: str = option("127.0.0.1", HOST_HELP)
    open_it: bool = option(True, "Open it in the browser.", "--open/--no-open")


@action
def serve_lessons(request: LessonsRequest, progress: Progress = quiet) -> ServedPages:
    """Open the course: learn reinforcement learning by doing it; until Ctrl-C.

    What is done is kept in this account's data folder; lesson 13 races the models of the present folder. Nothing leaves
    this machine, and nothing is fetched.

    Examples:
        racecraft lessons

        racecraft lessons --host 0.0.0.0 --no-open
    """
    from racecraft.console.workspace import Workspace
    from racecraft.lessons.service import make_lessons
    from racecraft.web.access import access_for

    access = access_for(request.host)
    application = make_lessons(access, models=Workspace(Path()).newest_runs)
    address, listening = listen(
        application, access, host=request.host, port=request.port, usual_port=PORT, progress=progress, path="/lessons"
    )
    return ServedPages(address, listening, request.open_it)
