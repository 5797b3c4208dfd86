"""`racecraft run`: a script that was written against other packages."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

CONTEXT = {"allow_interspersed_args": False, "ignore_unknown_options": True}
"""Everything behind the script's name is the script's own."""


def run(
    script: Annotated[Path, typer.Argument(metavar="SCRIPT", help="A Python script.")],
    args: Annotated[list[str] | None, typer.Argument(metavar="[ARGS]...", help="Its own arguments.")] = None,
) -> None:
    """Run a script with foreign names on the path: mlagents_envs, gym_unity, an old gym, sagemaker and its launchers.

    Example: racecraft run train-unity.py
    """
    from racecraft.compat.foreign import run_script

    run_script(script, tuple(args or ()))
