"""`racecraft workspace`: everything that a console keeps of one person as one file."""

from __future__ import annotations

import typer

from racecraft.cli.from_request import command
from racecraft.console.save_workspace import restore, save
from racecraft.console.workspace_file import RestoredWorkspace, SavedWorkspace

app = typer.Typer(help="Save a workspace as one file; bring it back on another machine.", no_args_is_help=True)


def _show_saved(saved: SavedWorkspace) -> None:
    print(f"{saved.file}: {saved.files} files, {saved.bytes / 1e6:.1f} MB before packing")
    for name in saved.left_out:
        print(f"left out: {name}")
    print(f"What to try next, on another machine:\n  racecraft workspace restore {saved.file.name}")


def _show_restored(restored: RestoredWorkspace) -> None:
    print(f"{restored.folder}: {len(restored.models)} models brought back")
    for name in restored.left_out:
        print(f"left out, there already: {name}")


app.command("save")(command(save, _show_saved))
app.command("restore")(command(restore, _show_restored))
