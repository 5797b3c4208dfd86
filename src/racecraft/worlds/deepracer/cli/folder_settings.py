"""`racecraft settings FOLDER`: every variable of a racer's folder, and what it does here."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path


def print_folder_settings(folder: Path, json: bool) -> None:
    """Print the table of a folder's variables.

    Raises:
        UserInputError: The folder or a file in it cannot be used.
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.deepracer.files.env_table import EnvRow, read_env_rows
    from racecraft.worlds.deepracer.files.run_env_variables import STATUSES

    rows = read_env_rows(folder)
    if json:
        print_json({"folder": str(folder), "variables": [asdict(row) for row in rows]})
        return
    titles = {**STATUSES, "unknown": "Unknown"}

    def value(row: EnvRow) -> str:
        return row.default if row.value is None else row.value

    name_width = max(len(row.name) for row in rows)
    value_width = min(34, max(len(value(row)) for row in rows))
    for status, title in titles.items():
        of_kind = [row for row in rows if row.status == status]
        if of_kind:
            print(f"{title}:")
        for row in of_kind:
            given = f"  [{row.place}]" if row.place else ""
            print(f"  {row.name:{name_width}}  {value(row):{value_width}}  {row.effect}{given}")
