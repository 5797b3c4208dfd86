"""`racecraft lessons`: the course in the browser."""

from __future__ import annotations

from racecraft.actions.served_pages import ServedPages
from racecraft.cli.from_request import command
from racecraft.console.serve_lessons import serve_lessons


def _show(served: ServedPages) -> None:
    print(f"The lessons at {served.address}; Ctrl-C ends it", flush=True)


lessons = command(serve_lessons, _show)
