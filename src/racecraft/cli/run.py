"""`racecraft run`: a script that was written against other packages."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.script_errors import format_script_error

CONTEXT = {"allow_interspersed_args": False, "ignore_unknown_options": True}
"""Everything behind the script's name is the script's own."""


def run(
    script: Annotated[Path, typer.Argument(metavar="SCRIPT", help="A Python script, or a notebook (.ipynb).")],
    args: Annotated[list[str] | None, typer.Argument(metavar="[ARGS]...", help="Its own arguments.")] = None,
    allow_errors: Annotated[
        bool,
        typer.Option("--allow-errors", help="Of a notebook: a cell that fails is told of, and the next one run."),
    ] = False,
) -> None:
    """Run a script with foreign names on the path: mlagents_envs, gym_unity, an old gym, sagemaker and its launchers.

    Of a notebook every cell is run, and what it would ask a shell is said and not run.

    Examples:

        racecraft run train-unity.py

        racecraft run --allow-errors rl_cartpole_ray_gymEnv.ipynb
    """
    from racecraft.compat.shims import run_script

    with format_script_error():
        run_script(script, tuple(args or ()), allow_errors)
