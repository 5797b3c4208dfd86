"""`racecraft checkpoints RUN`: every checkpoint that is kept, in order of merit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.cli.named_run import RUN_HELP, named_run
from racecraft.cli.options import Json

if TYPE_CHECKING:
    from racecraft.formats.checkpoint_ranking import RankedCheckpoint


def checkpoints(
    run: Annotated[str, typer.Argument(metavar="RUN[:which]", help=f"{RUN_HELP} With a checkpoint, that one alone.")],
    by: Annotated[str, typer.Option(help="progress, reward, laptime or steadiness.")] = "progress",
    most: Annotated[int | None, typer.Option("--most", min=1, help="Show so many of the best.")] = None,
    json: Json = False,
) -> None:
    """List every checkpoint that is kept, the best first, with what its evaluation came to.

    Any of them can be begun with, judged or handed on: --from RUN:N, --checkpoint N; a merit in place of N names the
    first by it: --from RUN:laptime. How many are kept say the settings runtime.keep_every and runtime.keep_mib.

    Examples:

        racecraft checkpoints runs/reinvent_base-1 --by laptime

        racecraft train --from runs/reinvent_base-1:laptime --track Oval_track
    """
    from racecraft.cli.output import print_json
    from racecraft.formats.checkpoint_ranking import MERITS, find_checkpoint, ranked
    from racecraft.formats.run_folder import RunFolder

    path, which = named_run(run)
    folder = RunFolder.open(path)
    found = ranked(folder, by)
    if which is not None:
        number = find_checkpoint(folder, which).iteration
        found = [one for one in found if one.entry.iteration == number]
    found = found[:most]
    marks = _marks(folder)
    if json:
        print_json({"run": str(run), "by": by, "checkpoints": [_told(one, marks) for one in found]})
        return
    print(f"{run}, by {by}: {MERITS[by][0]}")
    _print_table(found, marks)


def _marks(folder: Any) -> dict[int, list[str]]:
    """Return which checkpoint is called the best, and which the last."""
    from racecraft.formats.checkpoint import Checkpoints
    from racecraft.formats.tensor_file import CheckpointError

    shelf, marks = Checkpoints(folder.checkpoints), dict[int, list[str]]()
    for name in ("best", "last"):
        try:
            marks.setdefault(shelf.find(name).iteration, []).append(name)
        except CheckpointError:
            continue  # there is none yet
    return marks


def _told(one: RankedCheckpoint, marks: dict[int, list[str]]) -> dict[str, Any]:
    return {
        "iteration": one.entry.iteration,
        "steps": one.entry.steps,
        "called": marks.get(one.entry.iteration, []),
        "score": one.score,
        "reward": one.reward,
        "best_lap_seconds": one.best_lap_seconds,
        "mean_lap_seconds": one.mean_lap_seconds,
        "worst_progress_percent": one.worst_progress_percent,
        "lap_spread_seconds": one.lap_spread_seconds,
    }


def _print_table(found: list[RankedCheckpoint], marks: dict[int, list[str]]) -> None:
    from rich.table import Table

    from racecraft.cli.output import print_table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("checkpoint", "steps", "score", "reward", "best lap s", "worst start %", "spread s", ""):
        table.add_column(title, justify="right" if title else "left")
    for one in found:
        numbers = (one.score, one.reward, one.best_lap_seconds, one.worst_progress_percent, one.lap_spread_seconds)
        told = ["-" if value is None else f"{value:.2f}" for value in numbers]
        called = ", ".join(marks.get(one.entry.iteration, []))
        table.add_row(str(one.entry.iteration), f"{one.entry.steps:,}", *told, called)
    print_table(table)
