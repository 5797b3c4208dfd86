"""RUN[:which]: how every command is told a run, and which of its checkpoints."""

from __future__ import annotations

from pathlib import Path

RUN_HELP = "RUN[:best|last|N|laptime …], such as runs/reinvent_base-1."


def named_run(source: str, checkpoint: str | None = None) -> tuple[Path, str | None]:
    """Return the run folder and the checkpoint that was named, by a colon behind the run or by --checkpoint.

    Raises:
        SettingError: Both name one.
    """
    from racecraft.contract.errors import SettingError
    from racecraft.formats.checkpoint_ranking import split_source

    path, which = split_source(source)
    if path == source:
        return Path(source), checkpoint
    if checkpoint is not None:
        raise SettingError(
            "{source} and --checkpoint {checkpoint} were given; expected one of them to name it.",
            source=source,
            checkpoint=checkpoint,
        )
    return Path(path), which
