"""`racecraft workspace`: everything that a console keeps of one person as one file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from racecraft.cli.options import Json
from racecraft.console.serve import FOLDER

app = typer.Typer(help="Save a workspace as one file; bring it back on another machine.", no_args_is_help=True)


@app.command()
def save(
    output: Annotated[Path, typer.Argument(metavar="FILE.zip", help="The file to write.")],
    folder: Annotated[Path, typer.Argument(help="The workspace.")] = FOLDER,
    json: Json = False,
) -> None:
    """Save a workspace as one file.

    Example: racecraft workspace save my-workspace.zip
    """
    from racecraft.cli.output import print_json
    from racecraft.console.workspace_file import require_folder, save_workspace

    saved = save_workspace(require_folder(folder), output)
    if json:
        print_json(saved)
    else:
        print(f"{saved.file}: {saved.files} files, {saved.bytes / 1e6:.1f} MB before packing")
        for name in saved.left_out:
            print(f"left out: {name}")
        print(f"What to try next, on another machine:\n  racecraft workspace restore {output.name}")


@app.command()
def restore(
    file: Annotated[Path, typer.Argument(help="A file that `racecraft workspace save` wrote.")],
    folder: Annotated[Path, typer.Argument(help="The workspace; made where there is none.")] = FOLDER,
    json: Json = False,
) -> None:
    """Bring a saved workspace back: its models are added to those that are there.

    Example: racecraft workspace restore my-workspace.zip
    """
    from racecraft.cli.output import print_json
    from racecraft.console.workspace import Workspace
    from racecraft.console.workspace_file import restore_workspace

    restored = restore_workspace(file, Workspace.open(folder))
    if json:
        print_json(restored)
    else:
        print(f"{restored.folder}: {len(restored.models)} models brought back")
        for name in restored.left_out:
            print(f"left out, there already: {name}")
