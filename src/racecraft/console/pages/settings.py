"""Where everything lies, what takes the disk, keys, privacy, the bin; the workspace as one file."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import FileResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from racecraft.accounts.rights import Verb, may
from racecraft.console.parts import Look
from racecraft.console.section import Section
from racecraft.console.service import (
    Console,
    Fields,
    Page,
    act_route,
    form_with_file,
    looked,
    one,
    page_routes,
    person_of,
)
from racecraft.console.workspace_file import restore_workspace, save_workspace
from racecraft.console.workspace_settings import WorkspaceSettings, read_settings, write_settings
from racecraft.contract.errors import SettingError
from racecraft.jobs.preload import is_kept_warm
from racecraft.pages.every_part import every_part
from racecraft.training.notify import require_addresses
from racecraft.web.answers import page_answer

KEYS = (
    ("/", "search"), ("?", "this list"), ("n", "create a model"), ("g", "go to the garage"),
    ("j", "next row"), ("k", "row before"), ("x", "select a row"), ("c", "compare what is selected"),
    ("[", "the page of the list before"), ("]", "the next page"), ("z", "undo the last deletion"),
)  # fmt: skip
"""What modules/console.js answers."""
STARTER_VARIABLE = "RACECRAFT_STARTER"
"""Names the page of the start by a double-click, which tells of newer versions (packaging/begin.py)."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of the settings."""

    async def restore(request: Request) -> Response:
        async with form_with_file(request, "workspace") as (_, file):
            if file is None:
                raise SettingError("Workspace: found no file; expected one that was saved here, such as workspace.zip.")
            names = await run_in_threadpool(bring_back, console, file)
        return RedirectResponse("/models" if names else "/settings", 303)

    def save(request: Request) -> Response:
        folder = Path(tempfile.mkdtemp(prefix="racecraft-"))
        saved = save_workspace(console.workspace, folder / "workspace.zip")
        name = f"racecraft-workspace-{time.strftime('%Y-%m-%d')}.zip"
        return FileResponse(saved.file, filename=name, background=BackgroundTask(shutil.rmtree, folder, True))

    def disk(request: Request) -> Response:
        look = Look("racecraft.console/disk_use.html", "racecraft.console.disk_use:disk_use", (str(workspace),))
        return looked(console, request, look)

    def parts(request: Request) -> Response:
        return page_answer(request, "every_part.html", **every_part())

    workspace = console.workspace.path
    return [
        Route("/parts", parts),
        *page_routes(console, "/settings", settings_page),
        Route("/settings/disk", disk),
        act_route(console, "/settings/notify", choose_notifications),
        Route("/settings/workspace.zip", save),
        Route("/settings/restore", restore, methods=["POST"]),
    ]


def bring_back(console: Console, file: UploadFile) -> list[str]:
    """Add the models of a saved workspace; return their names.

    Raises:
        ArchiveError: The file is no saved workspace.
    """
    with tempfile.TemporaryDirectory(prefix="restore-", dir=console.workspace.path) as folder:
        target = Path(folder) / "workspace.zip"
        with open(target, "wb") as out:
            shutil.copyfileobj(file.file, out)
        restored = restore_workspace(target, console.workspace)
    console.watcher.refresh()
    return restored.models


def choose_notifications(console: Console, request: Request, fields: Fields) -> str | Page:
    """Keep where messages of trainings are sent to; what cannot be used is said beside what was typed."""
    typed = one(fields, "notify")
    try:
        addresses = require_addresses(typed.split())
    except SettingError as error:
        return _page(console, request, {"notify": typed, "wrong": str(error)}, 422)
    write_settings(console.workspace.path, WorkspaceSettings(notify=addresses))
    return "/settings"


def settings_page(console: Console, request: Request) -> Page:
    """Return where everything lies, how much room it takes, and what is kept in the bin."""
    return _page(console, request, {"notify": "\n".join(read_settings(console.workspace.path).notify)})


def _page(console: Console, request: Request, told: Mapping[str, str], status: int = 200) -> Page:
    return Page(
        "settings.html",
        "Settings",
        {
            "wrong": "",
            **told,
            **(_places(console) if may(person_of(request), Verb.RUN_MACHINE) else {}),
            "messages": list(read_settings(console.workspace.path).notify),
            "keys": KEYS,
            "room_gb": shutil.disk_usage(console.workspace.path).free / 1e9,
            "bin": [
                {"place": place, "name": name, "deleted": deleted} for place, name, deleted in console.workspace.bin()
            ],
        },
        here="/settings",
        status=status,
    )


def _places(console: Console) -> dict[str, Any]:
    return {
        "folder": str(console.workspace.path),
        "index": console.index.url,
        "jobs": str(console.home.path),
        "is_warm": is_kept_warm(console.home),
        "starter": os.environ.get(STARTER_VARIABLE, ""),
    }


SECTION = Section(routes=routes, label="Settings", href="/settings", icon="gear", order=90)
