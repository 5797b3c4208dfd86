"""The page on which a run is watched: one file that fetches nothing but the JSON of the server it comes from."""

from __future__ import annotations

import html
from importlib.resources import files


def watch_page(name: str) -> str:
    """Return the page; `name` is the run's, for the tab."""
    template = files("racecraft.analysis.watching").joinpath("page.html").read_text(encoding="utf-8")
    return template.replace("__NAME__", html.escape(name))
