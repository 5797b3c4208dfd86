"""Write one page that tells a run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

PAGE = "report.html"


@dataclass(frozen=True, kw_only=True)
class ReportRequest(Request):
    """Which run, and where its page is written."""

    run: Path = argument("A run folder, such as runs/reinvent_base-1.")
    output: Path | None = option(None, "HTML file to write; by default report.html in the run.")
    plots: tuple[Path, ...] = option((), "Your own plots: a Python file or a folder of them; of a car.")


@dataclass(frozen=True)
class Reported:
    """The page that was written."""

    report: Path


@action
def report(request: ReportRequest, progress: Progress = quiet) -> Reported:
    """Write one self-contained HTML page: what happened and what to try next, curves, best lap, actions, exits, cost.

    Example: racecraft report runs/reinvent_base-1
    """
    from racecraft.analysis.report import write_report
    from racecraft.formats.run_folder import RunFolder

    return Reported(write_report(RunFolder.open(request.run), request.output or request.run / PAGE, request.plots))


def leave_report(run: Path, progress: Callable[[str], None]) -> dict[str, str]:
    """Write a run's page into its folder at the end of a training and say so; return where it lies, by kind.

    Where it cannot be written, as of a run stopped before its first iteration, that is said and the training stands.
    """
    from racecraft.analysis.report import write_report
    from racecraft.contract.errors import UserInputError
    from racecraft.formats.run_folder import RunFolder

    try:
        page = write_report(RunFolder.open(run), run / PAGE)
    except UserInputError as error:
        progress(f"No report: {error}")
        return {}
    progress(f"report: {page}")
    return {"report": str(page)}
