"""What `--resume` allows beside it, for every command that trains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import typer

from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.formats.run_folder import RunFolder


def refuse_changes(
    context: typer.Context,
    run: Path | None,
    unchangeable: Sequence[str],
    example: str,
    kept_as: Mapping[str, tuple[str, Any]] | None = None,
) -> Path:
    """Return the run to go on with; it keeps what it was begun with, only its stops may change.

    What is said again as it was said at the beginning changes nothing and may be said.

    Args:
        context: How the command was typed.
        run: What --run named.
        unchangeable: The command's parameters that belong to a new run only, by their names in Python.
        example: A run folder as this command makes it.
        kept_as: Of parameters that the run keeps otherwise than they are typed: the name there, and the whole value.

    Raises:
        SettingError: No run is named, or something else is.
    """
    if run is None:
        raise SettingError(
            "--resume needs --run RUN, the folder to go on with, such as --run {example}.", example=example
        )
    arguments = {
        part.name: (part.metavar or str(part.name).upper()).strip("[]")
        for part in context.command.params
        if part.param_type_name == "argument"
    }
    kept_as = kept_as or {}
    for name in unchangeable:
        source = context.get_parameter_source(name)
        if (
            source is not None
            and source.name == "COMMANDLINE"
            and (name in arguments or not _is_as_begun(run, *kept_as.get(name, (name, context.params[name]))))
        ):
            flag = arguments.get(name, f"--{name.rstrip('_').replace('_', '-')}")
            raise SettingError(
                "{flag} cannot change when a run is resumed: it would no longer be the same training. "
                "Leave it out, or begin a new run from these weights with --from.",
                flag=flag,
            )
    return run


def _is_as_begun(run: Path, name: str, value: Any) -> bool:
    """Tell whether a parameter has the value that the run was begun with; what the run does not say is another."""
    try:
        job = RunFolder.open(run).read_job()
    except RunFolderError:
        return False
    begun = {"seed": job.get("seed"), **{_SPELT.get(key, key): said for key, said in job.get("asked", {}).items()}}
    said = begun.get(name)
    return said is not None and (value == said or [value] == said or value == [said])


_SPELT = {"set": "set_", "from": "from_"}
"""Names of job.json that Python has taken."""
