"""What `resume` allows beside it, for every training. Begin with `resumed_run`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from racecraft.actions.training_options import TrainingOptions
from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.formats.run_folder import RunFolder


def resumed_run(options: TrainingOptions) -> Path | None:
    """Return the run to go on with; it keeps what it was begun with, only its stops may change. None: a new run.

    An option that is given as it was given at the beginning changes nothing, and is allowed.

    Raises:
        SettingError: No run is named, or an option would change the training.
    """
    if not options.resume:
        return None
    run = options.run
    if run is None:
        raise SettingError(
            "--resume needs --run RUN, the folder to go on with, such as --run {example}.", example=options.example
        )
    kept_as = options.kept_as()
    for option, value in options.named().items():
        name = option.name
        if not options.is_kept(name) or _is_unchanged(run, *kept_as.get(name, (name, value))):
            continue
        raise SettingError(
            "{flag} cannot change when a run is resumed: it would no longer be the same training. "
            "Leave it out, or begin a new run from these weights with --from.",
            flag=option.full_name.strip("[]"),
        )
    return run


def _is_unchanged(run: Path, name: str, value: Any) -> bool:
    """Tell whether an option has the value that the run was begun with; what the run does not say is another."""
    try:
        job = RunFolder.open(run).read_job()
    except RunFolderError:
        return False
    begun = {"seed": job.get("seed"), **{_SPELT.get(key, key): stored for key, stored in job.get("asked", {}).items()}}
    stored = begun.get(name)
    value = list(value) if isinstance(value, tuple) else str(value) if isinstance(value, Path) else value
    return stored is not None and (value == stored or [value] == stored or value == [stored])


_SPELT = {"set": "set_", "from": "from_"}
"""Names of job.json that Python has taken."""
