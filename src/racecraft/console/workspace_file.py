"""A workspace as one file: saved here, brought back on another machine. Begin with `save_workspace`.

The file is a zip. It holds models, runs, drafts, driven laps, searches, logs and settings as they lie in the folder,
and before them `racecraft-workspace.json`: {"format", "version", "racecraft", "python", "saved", "files", "bytes"}. The
index is made again from the folders, so it stays behind; so do locks, the bin, links, races and other people's
workspaces, each of which can be saved by itself.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
import sqlite3
import tempfile
import time
import zipfile
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft import __version__
from racecraft.console.workspace import DRAFTS, DRIVEN, LEAGUE, LOGS, MODELS, PEOPLE, RUNS, TUNINGS, Workspace
from racecraft.console.workspace_settings import FILE as SETTINGS
from racecraft.contract.errors import UserInputError
from racecraft.contract.message import Message
from racecraft.formats.archive import ArchiveError, Limits, unpack
from racecraft.formats.atomic import PART, atomic_file, make_folder
from racecraft.formats.run_lock import LOCK

FORMAT, VERSION = "racecraft workspace", 1
MANIFEST = "racecraft-workspace.json"
FOLDERS = (MODELS, RUNS, DRAFTS, DRIVEN, TUNINGS, LOGS)
DATABASE = ".sqlite"
JOURNALS = tuple(DATABASE + end for end in ("-journal", "-wal", "-shm"))
PACKED = (".safetensors", ".parquet", ".mp4", ".png", ".jpg", ".gz", ".zip")
"""Files that deflating makes no smaller."""
LIMITS = Limits(max_bytes=512 * 2**30, max_members=5_000_000)
KIND = "a file that `racecraft workspace save` wrote"


@dataclass(frozen=True)
class SavedWorkspace:
    """What was saved."""

    file: Path
    files: int
    bytes: int
    """Of the files, before they were packed."""
    left_out: list[str]
    """Folders of other people's workspaces, and of races."""


@dataclass(frozen=True)
class RestoredWorkspace:
    """What was brought back."""

    folder: Path
    models: list[str]
    """Names that the models have now; a name that was taken got a number."""
    left_out: list[str]
    """Drafts, driven laps and settings that the workspace has already."""


def save_workspace(workspace: Workspace, file: Path) -> SavedWorkspace:
    """Write a workspace to one file, whole or not at all; trainings may go on meanwhile.

    Raises:
        OutputFileError: The file cannot be written.
    """
    found = [(path, path.relative_to(workspace.path).as_posix()) for path in _files(workspace.path, file)]
    total = sum(path.stat().st_size for path, _ in found)
    manifest = {
        "format": FORMAT, "version": VERSION, "racecraft": __version__, "python": platform.python_version(),
        "saved": round(time.time(), 1), "files": len(found), "bytes": total,
    }  # fmt: skip
    with atomic_file(file) as part, zipfile.ZipFile(part, "w", strict_timestamps=False) as archive:
        archive.writestr(MANIFEST, json.dumps(manifest, indent=2) + "\n")
        for path, name in found:
            packed = zipfile.ZIP_STORED if path.suffix.lower() in PACKED else zipfile.ZIP_DEFLATED
            if path.suffix == DATABASE:
                archive.writestr(name, _database(path), packed)
            else:
                archive.write(path, name, packed)
    return SavedWorkspace(file, len(found), total, _left_out(workspace.path))


def restore_workspace(file: Path, workspace: Workspace) -> RestoredWorkspace:
    """Add what a file holds to a workspace; nothing that is there is written over.

    Raises:
        ArchiveError: The file is damaged, or something else.
        OutputFileError: There is no room for it.
    """
    with tempfile.TemporaryDirectory(prefix="restore-", dir=workspace.path) as folder:
        inside = Path(folder)
        written = unpack(file, inside, KIND, LIMITS)
        _require_whole(file, inside, len(written))
        models = [_move_model(workspace, path) for place in (MODELS, RUNS) for path in _entries(inside / place)]
        for path in (*_entries(inside / TUNINGS), *_entries(inside / LOGS)):
            _move_new(path, workspace.free_folder(path.parent.name, path.name))
        single = [path for place in (DRAFTS, DRIVEN) for path in _entries(inside / place)]
        single += [inside / SETTINGS] if (inside / SETTINGS).is_file() else []
        left_out = [path.name for path in single if not _move_new(path, workspace.path / path.relative_to(inside))]
    return RestoredWorkspace(workspace.path, models, left_out)


def _left_out(folder: Path) -> list[str]:
    races = [folder / LEAGUE] if (folder / LEAGUE).is_dir() else []
    return [str(path) for path in (*(one for one in _entries(folder / PEOPLE) if one.is_dir()), *races)]


def _files(folder: Path, target: Path) -> Iterator[Path]:
    """Yield every plain file that is saved, folder by folder, in the order of the alphabet."""
    if (folder / SETTINGS).is_file():
        yield folder / SETTINGS
    for name in FOLDERS:
        for place, folders, files in os.walk(folder / name):
            folders[:] = sorted(one for one in folders if not (Path(place) / one).is_symlink())
            for file in sorted(files):
                path = Path(place) / file
                passing = file == LOCK or file.endswith((PART, *JOURNALS))
                left_behind = passing or path.is_symlink() or not path.is_file()
                if not left_behind and path.resolve() != target.resolve():
                    yield path


def _database(path: Path) -> bytes:
    """Return a database as of one moment; a search may write to it meanwhile."""
    with (
        closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as source,
        closing(sqlite3.connect(":memory:")) as copy,
    ):
        try:
            source.backup(copy)
        except sqlite3.DatabaseError:  # something else of that name
            return path.read_bytes()
        return copy.serialize()


def _require_whole(file: Path, inside: Path, count: int) -> None:
    """Refuse what is no saved workspace, or one of a later version, or one that lacks files."""
    try:
        manifest: dict[str, Any] = json.loads((inside / MANIFEST).read_text(encoding="utf-8"))
        kind, version, files = manifest["format"], int(manifest["version"]), int(manifest["files"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ArchiveError(file, Message("no {manifest} that can be read", manifest=MANIFEST), KIND) from error
    if kind != FORMAT or not 1 <= version <= VERSION:
        found = Message("format {kind!r}, version {version}", kind=kind, version=version)
        raise ArchiveError(file, found, Message("{format}, version {own}", format=FORMAT, own=VERSION))
    if count != files + 1:
        raise ArchiveError(file, Message("{count} files", count=count - 1), Message("{files}, as it says", files=files))


def _move_model(workspace: Workspace, path: Path) -> str:
    """Move a model's folder into the workspace under a name that is free; return the name."""
    name = workspace.free(path.name)
    make_folder(workspace.path / path.parent.name)
    shutil.move(path, workspace.path / path.parent.name / name)
    return name


def _move_new(path: Path, target: Path) -> bool:
    """Move a file unless one of its name is there; return whether."""
    if target.exists():
        return False
    make_folder(target.parent)
    shutil.move(path, target)
    return True


def _entries(folder: Path) -> list[Path]:
    return sorted(folder.iterdir()) if folder.is_dir() else []


def require_folder(folder: Path) -> Workspace:
    """Return the workspace of a folder that is there.

    Raises:
        UserInputError: There is none.
    """
    if not (folder.expanduser() / MODELS).is_dir():
        raise UserInputError(
            "{folder}: found no workspace; expected a folder that `racecraft console` made.", folder=str(folder)
        )
    return Workspace.open(folder)
