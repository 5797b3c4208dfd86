"""`racecraft watch RUN`."""

from __future__ import annotations

from racecraft.actions.watch import WatchedRun
from racecraft.actions.watch import watch as action
from racecraft.cli.from_request import command


def show(watched: WatchedRun) -> None:
    """Print where the page is."""
    print(f"{watched.run}: {watched.url}  (Ctrl-C ends)", flush=True)


watch = command(action, show)
