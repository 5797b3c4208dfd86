"""`racecraft console`: models, trainings and laps in the browser."""

from __future__ import annotations

from racecraft.cli.from_request import command
from racecraft.console.serve import ServedConsole
from racecraft.console.serve import console as action


def _show(served: ServedConsole) -> None:
    print(f"{served.folder} at {served.address}; Ctrl-C ends it", flush=True)


console = command(action, _show)
