"""`dr-upload-custom-files`, `dr-download-custom-files`: the racer's files to the bucket, and back."""

from __future__ import annotations

import shutil
from pathlib import Path

import typer

from racecraft.contract.errors import UserInputError
from racecraft.worlds.deepracer.cli.dr.bucket_sync import fetch_custom_files, send_custom_files
from racecraft.worlds.deepracer.cli.dr.context import installation, say_notes


def upload_custom_files(context: typer.Context) -> None:
    """Copy custom_files into the bucket, where a training reads them.

    Example: racecraft dr upload-custom-files
    """
    drfc = installation(context)
    say_notes(drfc)
    _sync(
        drfc.custom_files,
        drfc.custom_prefix,
        "Put reward_function.py and the two JSON files there.",
    )
    send_custom_files(drfc)


def download_custom_files(context: typer.Context) -> None:
    """Copy the files of the bucket over those in custom_files; of one that differs a copy is kept as FILE.bak.

    Example: racecraft dr download-custom-files
    """
    drfc = installation(context)
    say_notes(drfc)
    fetch_custom_files(drfc)
    _sync(drfc.custom_prefix, drfc.custom_files, "dr-upload-custom-files copies custom_files there.", keeps=True)


def _sync(source: Path, target: Path, hint: str, keeps: bool = False) -> None:
    """Copy the files of a folder that are not there yet, or differ, into another."""
    from racecraft.formats.atomic import make_folder, write_atomic

    files = sorted(path for path in source.rglob("*") if path.is_file()) if source.is_dir() else []
    if not files:
        raise UserInputError("{source}: holds no files; expected the racer's. {hint}", source=source, hint=hint)
    copied = 0
    for path in files:
        place = target / path.relative_to(source)
        if place.is_file() and place.read_bytes() == path.read_bytes():
            continue
        make_folder(place.parent)
        if keeps and place.is_file():
            shutil.copy2(place, place.with_name(place.name + ".bak"))
        write_atomic(place, path.read_bytes())
        print(f"copied {path} to {place}")
        copied += 1
    print(f"{target}: {len(files)} files, {copied} of them new or changed")
