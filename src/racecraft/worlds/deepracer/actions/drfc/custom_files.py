"""The racer's files of a DeepRacer-for-Cloud folder: to the bucket, and back."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.contract.errors import UserInputError
from racecraft.contract.progress import Progress, quiet
from racecraft.worlds.deepracer.actions.drfc.installation import InstallationRequest
from racecraft.worlds.deepracer.actions.drfc.sync import fetch_custom_files, send_custom_files


@dataclass(frozen=True)
class CopiedFiles:
    """Files that were copied."""

    target: Path
    files: int
    """In the source."""
    copied: int
    """New or changed."""


@action
def upload_custom_files(request: InstallationRequest, progress: Progress = quiet) -> CopiedFiles:
    """Copy custom_files into the bucket, where a training reads them.

    Example: racecraft dr upload-custom-files
    """
    drfc = request.open(progress)
    hint = "Put reward_function.py and the two JSON files there."
    copied = copy_changed(drfc.custom_files, drfc.custom_prefix, hint, progress)
    send_custom_files(drfc, progress)
    return copied


@action
def download_custom_files(request: InstallationRequest, progress: Progress = quiet) -> CopiedFiles:
    """Copy the files of the bucket over those in custom_files; of one that differs a copy is kept as FILE.bak.

    Example: racecraft dr download-custom-files
    """
    drfc = request.open(progress)
    fetch_custom_files(drfc, progress)
    hint = "dr-upload-custom-files copies custom_files there."
    return copy_changed(drfc.custom_prefix, drfc.custom_files, hint, progress, keeps=True)


def copy_changed(source: Path, target: Path, hint: str, progress: Progress, keeps: bool = False) -> CopiedFiles:
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
        progress(f"copied {path} to {place}")
        copied += 1
    return CopiedFiles(target, len(files), copied)
