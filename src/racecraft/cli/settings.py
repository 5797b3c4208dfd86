"""`racecraft settings`."""

from __future__ import annotations

from itertools import groupby

from racecraft.actions.settings import DefaultSettings, FolderSettings
from racecraft.actions.settings import settings as action
from racecraft.cli.from_request import command
from racecraft.cli.output import table

MAX_VALUE_WIDTH = 34


def _show(found: DefaultSettings | FolderSettings) -> None:
    if isinstance(found, FolderSettings):
        _show_folder(found)
        return
    from racecraft.settings.describe import value_text

    rows = [(row.full_name, value_text(value), row.unit, row.doc) for row, value in found.rows()]
    titles = ("setting", "default", "unit", "what it does")
    table(titles, rows, left=titles, whole=("setting", "unit"))


def _show_folder(found: FolderSettings) -> None:
    rows = found.variables
    name_width = max(len(row.name) for row in rows)
    value_width = min(MAX_VALUE_WIDTH, max(len(row.value) for row in rows))
    for title, under in groupby(rows, lambda row: row.title):
        print(f"{title}:")
        for row in under:
            given = f"  [{row.place}]" if row.place else ""
            print(f"  {row.name:{name_width}}  {row.value:{value_width}}  {row.effect}{given}")


settings = command(action, _show)
