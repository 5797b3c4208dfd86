"""`racecraft export`."""

from __future__ import annotations

from racecraft.actions.export import ExportedRun, export_run
from racecraft.cli.from_request import command


def _show(done: ExportedRun) -> None:
    for line in done.exported.lines:
        print(line)


export = command(export_run, _show)
