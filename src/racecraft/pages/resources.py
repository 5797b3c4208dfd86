"""Files that pages are made of, found in packages. Begin with `read_resource`.

A name is "file" for one of ours or "package/file" for one of another package, such as
"racecraft.worlds.deepracer.pages/why.html".
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable

OURS = "racecraft.pages"
FOLDERS = ("", "templates", "styles", "modules", "vendor")
"""Folders of a package in which a file may lie."""


def full_name(name: str) -> str:
    """Return a name with its package.

    >>> full_name("chart.js"), full_name("stranger.pages/map.js")
    ('racecraft.pages/chart.js', 'stranger.pages/map.js')
    """
    return name if "/" in name else f"{OURS}/{name}"


@cache
def read_resource(name: str) -> bytes:
    """Return what a file holds.

    Args:
        name: The file, with or without its package.

    Raises:
        LookupError: There is no such package or file. Names come from our own code, never from a request.
    """
    found = _find(full_name(name))
    if found is None:
        raise LookupError(f"{name}: there is no such file beside the pages.")
    return found.read_bytes()


def _find(name: str) -> Traversable | None:
    package, _, file = name.partition("/")
    try:
        root = files(package)
    except ModuleNotFoundError:
        return None
    places = (root / folder / file if folder else root / file for folder in FOLDERS)
    return next((place for place in places if place.is_file()), None)
