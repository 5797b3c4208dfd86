"""Copy the racer's files of a DeepRacer-for-Cloud folder to its bucket, and back."""

from __future__ import annotations

import shutil
from pathlib import Path

from racecraft.contract.errors import UserInputError
from racecraft.contract.progress import Progress


def copy_changed(source: Path, target: Path, hint: str, progress: Progress, keeps: bool = False) -> None:
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
    progress(f"{target}: {len(files)} files, {copied} of them new or changed")
