"""Ask a training that runs elsewhere to end."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument


@dataclass(frozen=True, kw_only=True)
class StopRequest(Request):
    """Which training."""

    run: Path = argument("The run folder of a training that is under way.")


@dataclass(frozen=True)
class StopRequested:
    """A training whose stop was requested."""

    run: Path
    is_training: bool
    """Whether a process of this machine trains there."""


@action
def stop(request: StopRequest, progress: Progress = quiet) -> StopRequested:
    """Ask a training to stop, from another terminal: it ends as if Ctrl-C had been pressed, and can go on later.

    Example: racecraft stop runs/reinvent_base-1
    """
    from racecraft.formats.run_folder import RunFolder

    folder = RunFolder.open(request.run)
    folder.request_stop()
    return StopRequested(request.run, folder.is_training())
