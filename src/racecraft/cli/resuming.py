"""What `--resume` allows beside it, for every command that trains."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import typer

from racecraft.contract.errors import SettingError


def refuse_changes(context: typer.Context, run: Path | None, unchangeable: Sequence[str], example: str) -> Path:
    """Return the run to go on with; it keeps what it was begun with, only its stops may change.

    Args:
        context: How the command was typed.
        run: What --run named.
        unchangeable: The command's parameters that belong to a new run only, by their names in Python.
        example: A run folder as this command makes it.

    Raises:
        SettingError: No run is named, or something else is.
    """
    if run is None:
        raise SettingError(f"--resume needs --run RUN, the folder to go on with, such as --run {example}.")
    arguments = {
        part.name: (part.metavar or str(part.name).upper()).strip("[]")
        for part in context.command.params
        if part.param_type_name == "argument"
    }
    for name in unchangeable:
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE":
            flag = arguments.get(name, f"--{name.rstrip('_')}")
            raise SettingError(
                f"{flag} cannot change when a run is resumed: it would no longer be the same training. "
                "Leave it out, or begin a new run from these weights with --from."
            )
    return run
