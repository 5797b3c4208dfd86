"""`racecraft new FOLDER`: three files and a page to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def new(
    folder: Annotated[Path, typer.Argument(help="A new or empty folder.")],
    reward: Annotated[
        str | None, typer.Option(help="A reward function of an installed package, in place of the example.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line.")] = False,
) -> None:
    """Make a folder with a reward function, two JSON files and a page that explains them, ready to edit.

    Example: racecraft new my-car
    """
    from racecraft.cli.output import print_json, word
    from racecraft.worlds.deepracer.training.new_model import new_model

    paths = new_model(folder, reward)
    if json:
        print_json({"folder": str(folder), "files": [path.name for path in paths]})
        return
    print(f"{folder} holds a car to begin with:")
    for path in paths:
        print(f"  {path.name}")
    print(f"Open {folder / 'reward_function.py'}, change it, then: racecraft train {word(folder)}")
