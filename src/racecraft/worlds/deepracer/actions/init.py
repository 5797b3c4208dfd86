"""Make a folder of DeepRacer for Cloud that needs no Docker."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument


@dataclass(frozen=True, kw_only=True)
class InitRequest(Request):
    """Which folder."""

    folder: Path = argument("A new folder, or one of DeepRacer for Cloud that stands.")


@dataclass(frozen=True)
class NewInstallation:
    """What was made, and what stood there already."""

    folder: Path
    made: tuple[Path, ...]
    kept: tuple[Path, ...]
    activate: str
    """The script that defines the dr- commands, from the folder on."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the paths by what became of them."""
        return {"folder": self.folder, "made": self.made, "kept": self.kept}


@action
def init(request: InitRequest, progress: Progress = quiet) -> NewInstallation:
    """Make system.env, run.env, custom_files and bin/activate.sh, which defines the dr- commands.

    What stands there already stays as it is.

    Example: racecraft init deepracer-for-cloud
    """
    from racecraft.worlds.deepracer.training.new_installation import new_installation

    made = new_installation(request.folder)
    return NewInstallation(request.folder, tuple(made.made), tuple(made.kept), made.activate)
