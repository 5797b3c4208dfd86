"""Write one page that tells a run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.analysis.aws_cost import ServiceCost

PAGE = "report.html"


@dataclass(frozen=True, kw_only=True)
class ReportRequest(Request):
    """Which run, and where its page is written."""

    run: Path = argument("A run folder, such as runs/reinvent_base-1.")
    output: Path | None = option(None, "HTML file to write; by default report.html in the run.")
    plots: tuple[Path, ...] = option((), "Your own plots: a Python file or a folder of them; of a car.")


@dataclass(frozen=True)
class Reported:
    """The page that was written, and the bill on it."""

    report: Path
    aws_usd: float
    """What the run would have cost on AWS, US dollars: an estimate; the sum of `aws_costs` whose price is known."""
    aws_costs: tuple[ServiceCost, ...]


@action
def report(request: ReportRequest, progress: Progress = quiet) -> Reported:
    """Write one self-contained HTML page: what happened and what to try next, curves, best lap, actions, exits, cost.

    Example: racecraft report runs/reinvent_base-1
    """
    from racecraft.analysis.aws_cost import run_costs, total_usd
    from racecraft.analysis.report import write_report
    from racecraft.analysis.run_facts import read_facts
    from racecraft.formats.run_folder import RunFolder

    run = RunFolder.open(request.run)
    page = write_report(run, request.output or request.run / PAGE, request.plots)
    costs = run_costs(read_facts(run))
    return Reported(page, total_usd(costs), costs)


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
