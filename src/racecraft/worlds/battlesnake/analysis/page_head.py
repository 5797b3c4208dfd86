"""What the pages of games and arenas begin with: colours by day and night, the frame, what they may ask.

`page_head.html` ends within the page's style; the page goes on with its own.
"""

from __future__ import annotations

import html
from importlib.resources import files

_HERE = "racecraft.worlds.battlesnake.analysis"


def with_head(page: str, title: str, sources: str = "'self'") -> str:
    """Return a page of this folder with its head laid before it.

    Args:
        page: File name, such as "board_page.html".
        title: Its headline.
        sources: Where it may ask, in the words of a Content-Security-Policy.
    """
    head, rest = (files(_HERE).joinpath(name).read_text(encoding="utf-8") for name in ("page_head.html", page))
    return rest.replace("__HEAD__", head.replace("__SOURCES__", sources), 1).replace("__TITLE__", html.escape(title))
