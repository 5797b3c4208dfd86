"""`racecraft settings`: the table of settings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def settings(
    folder: Annotated[
        Path | None, typer.Argument(help="A racer's folder: its run.env, variable by variable, and what each does.")
    ] = None,
    world: Annotated[str, typer.Option(help="Whose defaults, such as deepracer or gymnasium.")] = "deepracer",
    algorithm: Annotated[str, typer.Option(help="What learns; `racecraft algorithms` lists them.")] = "ppo",
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line.")] = False,
) -> None:
    """List every setting that `--set group.name=value` takes in one kind of training, with its default there.

    Of a folder of DeepRacer for Cloud: every variable, its value, its default, and what it does here or why not.

    Examples:

        racecraft settings --world gymnasium --algorithm ppo

        racecraft settings my-folder
    """
    if folder is not None:
        _print_folder(folder, json)
        return
    from rich.table import Table

    from racecraft.algorithms.registry import find_algorithm
    from racecraft.cli.output import print_json, print_table
    from racecraft.settings.describe import value_text
    from racecraft.settings.overrides import as_dictionary
    from racecraft.settings.table import rows_of
    from racecraft.training.worlds import training_in

    defaults = training_in(world).default_settings(find_algorithm(algorithm))
    if json:
        print_json(as_dictionary(defaults))
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("setting", "default", "unit", "what it does"):
        table.add_column(title, no_wrap=title in ("setting", "unit"))
    for name in defaults:
        for row in rows_of(getattr(defaults, name), name):
            table.add_row(row.full_name, value_text(getattr(getattr(defaults, name), row.name)), row.unit, row.doc)
    print_table(table)


def _print_folder(folder: Path, json: bool) -> None:
    """Have the world that knows such folders print what it sets.

    Raises:
        UserInputError: No installed world knows any, or the folder cannot be used.
    """
    from racecraft.contract.errors import SettingError
    from racecraft.contract.kinds import kinds

    for kind in kinds():
        if kind.folder_settings:
            kind.piece("folder_settings")(folder, json)
            return
    raise SettingError(
        "{folder}: no installed world reads folders; expected one that does, such as deepracer.", folder=folder
    )
