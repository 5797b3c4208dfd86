"""A part of the console: its routes, and its entry in the side bar where it has one.

`application.SECTIONS` lists the console's own; a world's come from `WorldParts.sections`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from starlette.routing import BaseRoute


@dataclass(frozen=True, kw_only=True)
class Section:
    """Pages that belong together."""

    routes: Callable[[Any], Sequence[BaseRoute]]
    """Called once with the `service.Console` they answer for."""
    label: str = ""
    """Of the entry in the side bar; "": there is none."""
    href: str = ""
    """Where the entry leads; a `service.Page` whose `here` is the same belongs to it."""
    icon: str = ""
    """A name of `icon_path` in pages/templates/parts.html."""
    order: int = 50
    """Entries stand by this number: garage 0, tracks 10, races 20, lessons 30, drive 40, people 60, jobs 80,
    settings 90."""
