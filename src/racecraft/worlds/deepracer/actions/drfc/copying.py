"""Copy files of a DeepRacer-for-Cloud bucket, which is a folder here."""

from __future__ import annotations

import shutil
from pathlib import Path

from racecraft.contract.errors import UserInputError


def copy_files(source: Path, target: Path, recursive: bool) -> Path:
    """Copy a file, or with `recursive` a folder; return where it lies.

    Raises:
        UserInputError: There is nothing to copy, or it cannot be written.
    """
    from racecraft.formats.atomic import make_folder
    from racecraft.formats.run_lock import unwritable

    if not source.exists():
        raise UserInputError("{source}: there is nothing to copy; expected a file or a folder.", source=source)
    if source.is_dir() and not recursive:
        raise UserInputError("{source}: is a folder; expected a file, or --recursive.", source=source)
    try:
        if source.is_dir():
            shutil.copytree(source, target, dirs_exist_ok=True)
        else:
            target = target / source.name if target.is_dir() else target
            make_folder(target.parent)
            shutil.copy2(source, target)
    except OSError as error:
        raise unwritable(target, error) from error
    return target
