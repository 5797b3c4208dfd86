"""`racecraft report`."""

from __future__ import annotations

from racecraft.actions.report import Reported
from racecraft.actions.report import report as action
from racecraft.cli.from_request import command


def show(done: Reported) -> None:
    """Print where the page is."""
    print(f"report: {done.report}")


report = command(action, show)
