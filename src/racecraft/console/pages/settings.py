"""Where everything lies, how much room it takes, and what is kept in the bin."""

from __future__ import annotations

import shutil

from starlette.requests import Request
from starlette.routing import BaseRoute

from racecraft.accounts.rights import Verb, may
from racecraft.console.section import Section
from racecraft.console.service import Console, Page, page_routes, person_of


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of the settings."""
    return [*page_routes(console, "/settings", settings_page)]


def settings_page(console: Console, request: Request) -> Page:
    """Return where everything lies, how much room it takes, and what is kept in the bin."""
    return Page(
        "settings.html",
        "Settings",
        {
            **(_places(console) if may(person_of(request), Verb.RUN_MACHINE) else {}),
            "room_gb": shutil.disk_usage(console.workspace.path).free / 1e9,
            "bin": [
                {"place": place, "name": name, "deleted": deleted} for place, name, deleted in console.workspace.bin()
            ],
        },
        here="/settings",
    )


def _places(console: Console) -> dict[str, str]:
    return {"folder": str(console.workspace.path), "index": console.index.url, "jobs": str(console.home.path)}


SECTION = Section(routes=routes, label="Settings", href="/settings", icon="gear", order=90)
