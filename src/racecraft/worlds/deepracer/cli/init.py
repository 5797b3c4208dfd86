"""`racecraft init FOLDER`: a folder of DeepRacer for Cloud that needs no Docker."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.options import Json


def init(
    folder: Annotated[Path, typer.Argument(help="A new folder, or one of DeepRacer for Cloud that stands.")],
    json: Json = False,
) -> None:
    """Make system.env, run.env, custom_files and bin/activate.sh, which defines the dr- commands.

    What stands there already stays as it is.

    Example: racecraft init deepracer-for-cloud
    """
    from racecraft.cli.output import print_json, word
    from racecraft.worlds.deepracer.training.new_installation import new_installation

    made = new_installation(folder)
    if json:
        print_json({"folder": str(folder), "made": list(map(str, made.made)), "kept": list(map(str, made.kept))})
        return
    for path in made.made:
        print(f"made  {path}")
    for path in made.kept:
        print(f"kept  {path}")
    print(f"\ncd {word(folder)}\nsource ./{made.activate}\ndr-update-env\ndr-upload-custom-files\ndr-start-training")
