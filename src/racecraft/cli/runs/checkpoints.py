"""`racecraft checkpoints`."""

from __future__ import annotations

from racecraft.actions.checkpoints import CheckpointList
from racecraft.actions.checkpoints import checkpoints as action
from racecraft.cli.from_request import command
from racecraft.cli.output import table


def _show(found: CheckpointList) -> None:
    if found.freed_bytes is not None:
        print(f"{found.freed_bytes / 1e6:.1f} MB are free now")
    print(f"{found.run}, by {found.by}: {found.merit}")
    rows = []
    for one in found.checkpoints:
        figures = (one.score, one.reward, one.best_lap_seconds, one.worst_progress_percent, one.lap_spread_seconds)
        cells = ["-" if value is None else f"{value:.2f}" for value in figures]
        rows.append((str(one.iteration), f"{one.steps:,}", *cells, ", ".join(one.called)))
    titles = ("checkpoint", "steps", "score", "reward", "best lap s", "worst start %", "spread s", "")
    table(titles, rows, left=("",))


checkpoints = command(action, _show)
