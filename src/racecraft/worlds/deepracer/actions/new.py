"""Make a folder with a car to begin with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option


@dataclass(frozen=True, kw_only=True)
class NewRequest(Request):
    """Which folder."""

    folder: Path = argument("A new or empty folder.")
    reward: str | None = option(
        None, "A sample of `racecraft reward samples`, or one of an installed package, in place of the example."
    )


@dataclass(frozen=True)
class NewFolder:
    """The folder that was made, and the names of its files."""

    folder: Path
    files: list[str]


@action
def new(request: NewRequest, progress: Progress = quiet) -> NewFolder:
    """Make a folder with a reward function, two JSON files and a page that explains them, ready to edit.

    Example: racecraft new my-car
    """
    from racecraft.worlds.deepracer.training.new_model import new_model

    paths = new_model(request.folder, request.reward)
    return NewFolder(request.folder, [path.name for path in paths])
