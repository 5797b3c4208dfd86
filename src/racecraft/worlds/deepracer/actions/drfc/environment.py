"""The variables of a DeepRacer-for-Cloud folder: read again, and put into the shell."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import option
from racecraft.worlds.deepracer.actions.drfc.installation import InstallationRequest
from racecraft.worlds.deepracer.actions.drfc.shell import SHELLS, shell_lines
from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder


@dataclass(frozen=True, kw_only=True)
class ShellRequest(InstallationRequest):
    """Which installation, for which shell."""

    shell: str = option("sh", "Whose language: sh or powershell.", choices=SHELLS)


@dataclass(frozen=True)
class ReadSettings:
    """The settings of an installation as its files have them."""

    config: Path
    variables: int
    run_id: int


@dataclass(frozen=True)
class ShellLines:
    """Lines that a shell evaluates to take over the variables of an installation."""

    lines: list[str]


@action
def update_env(request: InstallationRequest, progress: Progress = quiet) -> ReadSettings:
    """Read system.env and run.env again and say what was noticed; dr-update-env puts them into the shell as well.

    Example: racecraft dr update-env
    """
    drfc = request.installation.open_files()
    _report(drfc, progress)
    return ReadSettings(drfc.config, len(drfc.env.run.values), drfc.run_id)


@action
def shell_env(request: ShellRequest, progress: Progress = quiet) -> ShellLines:
    """Print what a shell evaluates to take over the installation's variables; people read standard error."""
    drfc = request.installation.open_files()
    if not drfc.flag("DR_QUIET_ACTIVATE"):
        _report(drfc, progress)
        progress(f"{drfc.config}: {len(drfc.env.run.values)} variables, run id {drfc.run_id}")
    return ShellLines(list(shell_lines(drfc, request.shell)))


def _report(drfc: DrfcFolder, progress: Progress) -> None:
    for note in (*drfc.env.run.notes, *drfc.notes):
        progress(f"- {note}")
