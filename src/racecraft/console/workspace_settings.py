"""What holds for every training that a workspace's console begins, as a file: `settings.json`, version 1.

{"format": "racecraft workspace settings", "version": 1, "notify": ["desktop", "https://…"]}
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from racecraft.contract.errors import InputFileError
from racecraft.formats.atomic import write_atomic
from racecraft.formats.json_text import parse_json
from racecraft.formats.user_file import read_regular

FILE = "settings.json"
FORMAT, VERSION = "racecraft workspace settings", 1


@dataclass(frozen=True, kw_only=True)
class WorkspaceSettings:
    """Chosen once for all trainings."""

    notify: tuple[str, ...] = ()
    """Addresses as of `racecraft train --notify`."""

    def words(self) -> tuple[str, ...]:
        """Return the options that a training is given."""
        return tuple(f"--notify={address}" for address in self.notify)


def read_settings(workspace: Path) -> WorkspaceSettings:
    """Return the settings of a workspace; where it has none, the defaults.

    Raises:
        InputFileError: The file is no such settings.
    """
    path = workspace / FILE
    if not path.is_file():
        return WorkspaceSettings()
    try:
        told = parse_json(read_regular(path))
        if (told.pop("format"), told.pop("version")) != (FORMAT, VERSION):
            raise ValueError("another format or version")
        return WorkspaceSettings(notify=tuple(map(str, told["notify"])))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputFileError(path, str(error), f"settings of a workspace, version {VERSION}") from error


def write_settings(workspace: Path, settings: WorkspaceSettings) -> None:
    """Write the settings of a workspace.

    Raises:
        OutputFileError: The file cannot be written.
    """
    told = {"format": FORMAT, "version": VERSION, **asdict(settings)}
    write_atomic(workspace / FILE, json.dumps(told, indent=2) + "\n")
