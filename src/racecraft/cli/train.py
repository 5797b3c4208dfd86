"""A world's command that trains, made from its action. Begin with `train_command`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from racecraft.actions.action import Action
from racecraft.actions.submit_job import Submitted
from racecraft.actions.train_run import TrainedRun
from racecraft.actions.train_seeds import TrainedSeeds
from racecraft.cli.from_request import command
from racecraft.cli.jobs.submitted import show_submitted
from racecraft.cli.runs.compare import show as show_comparison


def train_command(action: Action[Any], show: Callable[[Any], None]) -> Callable[..., None]:
    """Return a command that trains.

    Args:
        action: The world's.
        show: Prints what a training came to, or another result of the action.
    """

    def show_any(result: Any) -> None:
        if isinstance(result, Submitted):
            show_submitted(result)
        elif isinstance(result, TrainedSeeds):
            _show_seeds(result)
        elif isinstance(result, TrainedRun) and result.exit_code:
            print(f"saved in {result.run.path}; --resume goes on from there")
        else:
            show(result)

    return command(action, show_any)


def _show_seeds(trained: TrainedSeeds) -> None:
    for job in trained.jobs:
        show_submitted(job)
    if trained.comparison is not None:
        show_comparison(trained.comparison)


def verdict(summary: Mapping[str, Any]) -> str:
    """Return the word before what a judged training came to: none where no score counts as solved.

    >>> verdict({"solved": False, "evaluation": {"threshold": 475.0}})
    'not solved, '
    >>> verdict({"solved": False, "evaluation": {"threshold": None}})
    ''
    """
    if summary["evaluation"]["threshold"] is None:
        return ""
    return "solved, " if summary["solved"] else "not solved, "
