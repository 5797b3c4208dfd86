"""`racecraft drive TRACK`: a car under one's own hands, in the browser."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.worlds.deepracer.actions.drive import ServedDrive
from racecraft.worlds.deepracer.actions.drive import drive as action


def _show(served: ServedDrive) -> None:
    print(f"{served.track} at {served.address}; Ctrl-C ends it", flush=True)


drive = command(action, _show)
