"""`racecraft report RUN`: one page that tells a run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

PAGE = "report.html"


def leave_report(run: Path, tell: Callable[[str], None]) -> dict[str, str]:
    """Write a run's page into its folder at the end of a training and say so; return where it lies, by kind.

    Where it cannot be written, as of a run stopped before its first iteration, that is said and the training stands.
    """
    from racecraft.analysis.report import write_report
    from racecraft.contract.errors import UserInputError
    from racecraft.formats.run_folder import RunFolder

    try:
        page = write_report(RunFolder.open(run), run / PAGE)
    except UserInputError as error:
        tell(f"No report: {error}")
        return {}
    tell(f"report: {page}")
    return {"report": str(page)}


def report(
    run: Annotated[Path, typer.Argument(help="A run folder, such as runs/reinvent_base-1.")],
    output: Annotated[Path | None, typer.Option(help="HTML file to write; by default report.html in the run.")] = None,
    plots: Annotated[
        list[Path] | None, typer.Option(help="Your own plots: a Python file or a folder of them; of a car.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Write one self-contained HTML page: what happened and what to try next, curves, best lap, actions, exits, cost.

    Example: racecraft report runs/reinvent_base-1
    """
    from racecraft.analysis.report import write_report
    from racecraft.cli.output import print_json
    from racecraft.formats.run_folder import RunFolder

    page = write_report(RunFolder.open(run), output or run / PAGE, plots or ())
    if json:
        print_json({"report": str(page)})
        return
    print(f"report: {page}")
