"""Every variable of a racer's folder, and what it does here, for `racecraft settings FOLDER`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from racecraft.actions.settings import FolderSettings, FolderVariable
from racecraft.worlds.deepracer.files.env_table import read_env_rows
from racecraft.worlds.deepracer.files.run_env_variables import VARIABLE_EFFECTS


def folder_settings(folder: Path) -> FolderSettings:
    """Return the variables of a folder, by what becomes of them.

    Raises:
        UserInputError: The folder or a file in it cannot be used.
    """
    rows, titles = read_env_rows(folder), {**VARIABLE_EFFECTS, "unknown": "Unknown"}
    variables = [
        FolderVariable(row.name, title, row.default if row.value is None else row.value, row.effect, row.location or "")
        for status, title in titles.items()
        for row in rows
        if row.status == status
    ]
    return FolderSettings(variables, {"folder": str(folder), "variables": [asdict(row) for row in rows]})
