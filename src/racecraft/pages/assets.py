"""Styles, modules, fonts and pictures of pages: by address for a server, by their own bytes for a file.

    served     /assets/chart.3f9a….js, kept by browsers for a year because a changed file has another address
    a file     data:text/javascript;base64,…, so that the page is one file that fetches nothing

A style names a file as `url("inter.woff2")`; a module imports another as `from "racecraft.pages/uplot.js"`, which an
import map of the page leads to the address.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

from racecraft.pages.resources import full_name, read_resource

PREFIX = "/assets/"
KINDS = {
    "css": "text/css", "js": "text/javascript", "woff2": "font/woff2", "svg": "image/svg+xml", "png": "image/png",
    "jpg": "image/jpeg", "json": "application/json",
}  # fmt: skip
_URL = re.compile(rb'url\("([\w./-]+)"\)')
_IMPORT = re.compile(rb"""(?:from|import)\s*["']([\w.-]+/[\w.-]+\.js)["']""")


@dataclass(frozen=True)
class Asset:
    """A file as a browser gets it."""

    name: str
    """With its package."""
    data: bytes

    @property
    def kind(self) -> str:
        """Its media type."""
        return KINDS[self.name.rpartition(".")[2]]

    @property
    def file(self) -> str:
        """Its file name with the sum of its bytes."""
        stem, _, ending = self.name.rpartition("/")[2].rpartition(".")
        return f"{stem}.{hashlib.sha256(self.data).hexdigest()[:16]}.{ending}"

    @property
    def address(self) -> str:
        """Where a server has it."""
        return PREFIX + self.file

    @property
    def inline(self) -> str:
        """Its bytes as an address."""
        return f"data:{self.kind};base64,{base64.b64encode(self.data).decode()}"


_served: dict[str, Asset] = {}


@cache
def asset(name: str, inline: bool = False) -> Asset:
    """Return a file for a page; what a style names is led to its address.

    Args:
        name: The file, with or without its package.
        inline: Whether addresses inside it are bytes.

    Raises:
        LookupError: There is no such file.
    """
    name = full_name(name)
    data = read_resource(name)
    if name.endswith(".css"):
        package = name.partition("/")[0]

        def lead(found: re.Match[bytes]) -> bytes:
            inner = found[1].decode()
            target = asset(inner if "/" in inner else f"{package}/{inner}", inline)
            return f'url("{target.inline if inline else target.address}")'.encode()

        data = _URL.sub(lead, data)
    made = Asset(name, data)
    if not inline:
        _served[made.file] = made
    return made


def find_served(file: str) -> Asset | None:
    """Return the asset that some page named by this address; None for every other name."""
    return _served.get(file)


def imported(names: Iterable[str]) -> list[str]:
    """Return modules and all that they import, by full name, in order of the alphabet."""
    found: set[str] = set()
    waiting = [full_name(name) for name in names]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += [other.decode() for other in _IMPORT.findall(read_resource(name))]
    return sorted(found)
