"""`racecraft export`."""

from __future__ import annotations

from racecraft.actions.export import ExportedRun, export_run
from racecraft.cli.from_request import command


def show(done: ExportedRun) -> None:
    """Print what was written."""
    for line in done.exported.lines:
        print(line)


export = command(export_run, show)
