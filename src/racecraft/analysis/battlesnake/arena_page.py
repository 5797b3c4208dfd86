"""The page of an arena: ratings with their intervals, who met whom, the latest games. It asks its server for all of it.

The page itself is `arena_page.html`; what it is told stands in `serving/arena_server.py`.
"""

from __future__ import annotations

import html
from importlib.resources import files


def arena_page(name: str) -> str:
    """Return the page of an arena called so."""
    template = files("racecraft.analysis.battlesnake").joinpath("arena_page.html").read_text(encoding="utf-8")
    return template.replace("__TITLE__", html.escape(name))
