"""`dr-update-env`: read the files again, and put what they say into the shell."""

from __future__ import annotations

import sys
from typing import Annotated, TextIO

import typer

from racecraft.contract.errors import SettingError, nearest
from racecraft.worlds.deepracer.actions.drfc.shell import SHELLS, shell_lines
from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder, open_drfc_folder


def update_env(context: typer.Context) -> None:
    """Read system.env and run.env again and say what was noticed; dr-update-env puts them into the shell as well.

    Example: racecraft dr update-env
    """
    _tell(_files(context), sys.stdout)


def env(
    context: typer.Context, shell: Annotated[str, typer.Option(help="Whose language: sh or powershell.")] = "sh"
) -> None:
    """Print what a shell evaluates to take over the installation's variables; people read standard error."""
    if shell not in SHELLS:
        raise SettingError("--shell {shell!r} is not known. {hint}", shell=shell, hint=nearest(shell, SHELLS))
    drfc = _files(context)
    print("\n".join(shell_lines(drfc, shell)))
    if not drfc.flag("DR_QUIET_ACTIVATE"):
        _tell(drfc, sys.stderr)


def _tell(drfc: DrfcFolder, stream: TextIO) -> None:
    for note in (*drfc.env.run.notes, *drfc.notes):
        print(f"- {note}", file=stream)
    print(f"{drfc.config}: {len(drfc.env.run.values)} variables, run id {drfc.run_id}", file=stream)


def _files(context: typer.Context) -> DrfcFolder:
    """Return the installation as its files say, the shell left out: it is the shell that is brought up to date."""
    return open_drfc_folder(*context.obj)
