"""`racecraft export`: hand a trained policy over to another program, or to a car."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.actions.named_run import RUN_HELP, named_run
from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.kind import load
from racecraft.contract.kinds import kinds

TARGETS = tuple(name for kind in kinds() for name in kind.exporters)
"""What the exporters of all installed worlds write for."""


def export(
    run: Annotated[str, typer.Argument(metavar="RUN[:which]", help=RUN_HELP)],
    to: Annotated[str, typer.Option(help=f"Whom it is for: {', '.join(TARGETS)}.")],
    checkpoint: Annotated[
        str | None,
        typer.Option(help="best, last, an iteration's number, or a merit such as laptime; by default the best."),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(help="A file, or a folder; by default in RUN/export."),
    ] = None,
    check: Annotated[
        bool, typer.Option("--check/--no-check", help="Ask checkpoint and exported file side by side before writing.")
    ] = True,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Write a trained policy as a file that another program loads, and check that it acts alike.

    Examples:

        racecraft export runs/Basic-1 --to unity

        racecraft export runs/reinvent_base-1 --to car

        racecraft export runs/aws-1 --to drfc --output bucket/rl-deepracer-mine

        racecraft export runs/reinvent_base-1:laptime --to onnx --output policy.onnx
    """
    if to not in TARGETS:
        raise SettingError("--to {to!r} is not known. {hint}", to=to, hint=nearest(to, TARGETS))
    export_run(*named_run(run, checkpoint), to, output, check, json)


def export_run(
    run: Path, which: str | None, to: str, output: Path | None, check: bool = True, json: bool = False
) -> None:
    """Export a checkpoint of a run, None: the best, and say what was written."""
    from racecraft.cli.output import print_json

    exported = load(_exporter(run, to))(run, to, which, output, check)
    if json:
        print_json({"run": str(run), "to": to, **exported.figures})
        return
    for line in exported.lines:
        print(line)


def _exporter(run: Path, to: str) -> str:
    """Return the exporter of that name; where several worlds have one, that of the run's own."""
    found = {kind.name: kind.exporters[to] for kind in kinds() if to in kind.exporters}
    if len(found) > 1:
        from racecraft.formats.run_folder import RunFolder

        kind = str(RunFolder.open(run).read_job().get("kind"))
        return found.get(kind, next(iter(found.values())))
    return next(iter(found.values()))
