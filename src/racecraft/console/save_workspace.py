"""Save a workspace as one file, and bring it back."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.console.serve import FOLDER
from racecraft.console.workspace_file import RestoredWorkspace, SavedWorkspace
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument


@dataclass(frozen=True, kw_only=True)
class SaveRequest(Request):
    """Which workspace goes into which file."""

    output: Path = argument("The file to write.", metavar="FILE.zip")
    folder: Path = argument("The workspace.", FOLDER)


@dataclass(frozen=True, kw_only=True)
class RestoreRequest(Request):
    """Which file is added to which workspace."""

    file: Path = argument("A file that `racecraft workspace save` wrote.")
    folder: Path = argument("The workspace; made where there is none.", FOLDER)


@action
def save(request: SaveRequest, progress: Progress = quiet) -> SavedWorkspace:
    """Save a workspace as one file.

    Example: racecraft workspace save my-workspace.zip
    """
    from racecraft.console.workspace_file import require_folder, save_workspace

    return save_workspace(require_folder(request.folder), request.output)


@action
def restore(request: RestoreRequest, progress: Progress = quiet) -> RestoredWorkspace:
    """Bring a saved workspace back: its models are added to those that are there.

    Example: racecraft workspace restore my-workspace.zip
    """
    from racecraft.console.workspace import Workspace
    from racecraft.console.workspace_file import restore_workspace

    return restore_workspace(request.file, Workspace.open(request.folder))
