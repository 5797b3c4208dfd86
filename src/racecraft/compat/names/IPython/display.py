"""`IPython.display`, without anybody to show things to: they are told in a line."""

from __future__ import annotations

from typing import Any


class HTML:
    """Something to be shown in a page; here only its size is told."""

    def __init__(self, data: Any = None, url: str | None = None, filename: str | None = None, **recorded: Any) -> None:
        self.data, self.url, self.filename = data, url, filename

    def __repr__(self) -> str:
        where = self.url or self.filename
        return f"<{type(self).__name__} {where or f'of {len(self.data or ())} characters'}>"


class Image(HTML):
    """A picture."""


class Video(HTML):
    """A film."""


class Markdown(HTML):
    """A text."""


def display(*objects: Any, **recorded: Any) -> None:
    """Tell what would be shown."""
    for one in objects:
        print(repr(one))


def clear_output(wait: bool = False) -> None:
    """Lines that were told stay told."""


__all__ = ["HTML", "Image", "Markdown", "Video", "clear_output", "display"]
