"""The page of an arena: ratings with their intervals, who met whom, the latest games. It asks its server for all of it.

The page itself is `arena_page.html`; what it is told stands in `serving/arena_server.py`.
"""

from __future__ import annotations

from racecraft.worlds.battlesnake.analysis.page_head import with_head


def arena_page(name: str) -> str:
    """Return the page of an arena called so."""
    return with_head("arena_page.html", name)
