"""Copy the run folder of a model to another place: for an upload, a download, a clone to be judged. See `copy_model`.

Everything goes along but the lock, somebody's asking to stop and, where one checkpoint is wanted, all others. The copy
is made beside its place and moved there in the end, so that a copy that is broken off leaves nothing behind.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from pathlib import Path

from racecraft.contract.errors import RunFolderError
from racecraft.formats.atomic import PART, write_atomic
from racecraft.formats.checkpoint import INDEX, VERSION, CheckpointEntry
from racecraft.formats.checkpoint_ranking import find_checkpoint
from racecraft.formats.run_folder import CHECKPOINTS, STOP, RunFolder
from racecraft.formats.run_lock import LOCK, unwritable


def copy_model(source: RunFolder, target: Path, which: str | None = None) -> CheckpointEntry | None:
    """Copy a run folder.

    Args:
        source: The model.
        target: Where to; nothing but an empty folder may stand there.
        which: "best", "last" or a number: the one checkpoint that goes along; None: all of them.

    Returns:
        The checkpoint that went along; None: all did.

    Raises:
        RunFolderError: Something stands at the target, or it cannot be written.
        CheckpointError: There is no such checkpoint.
    """
    chosen = None if which is None else find_checkpoint(source, which)
    require_empty(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".copying-", dir=target.parent) as place:
            copy = Path(place) / target.name
            _copy_tree(source, copy, chosen)
            if chosen is not None:
                _keep_only(copy / CHECKPOINTS, chosen)
            if target.is_dir():
                target.rmdir()
            copy.rename(target)
    except OSError as error:
        raise unwritable(target, error) from error
    return chosen


def require_empty(place: Path) -> None:
    """Refuse a place that holds anything.

    Raises:
        RunFolderError: It does.
    """
    if place.is_symlink() or (place.exists() and not place.is_dir()):
        raise RunFolderError("{place}: is no folder; expected a prefix that is free. Give another.", place=place)
    if place.is_dir() and any(place.iterdir()):
        raise RunFolderError(
            "{place}: holds files already; expected a free prefix. Give another, or wipe it with -w.", place=place
        )


def wipe_model(place: Path) -> None:
    """Take a model's folder away, where there is one.

    Raises:
        RunFolderError: It is none of ours to wipe: a link, a file, or the folder of a training that is under way.
    """
    if place.is_symlink() or (place.exists() and not place.is_dir()):
        raise RunFolderError("{place}: is no folder; expected the folder of a model. It is not wiped.", place=place)
    if not place.is_dir():
        return
    if (place / LOCK).exists():
        RunFolder(place).lock().release()  # refused while somebody trains there
    try:
        shutil.rmtree(place)
    except OSError as error:
        raise unwritable(place, error) from error


def _copy_tree(source: RunFolder, copy: Path, chosen: CheckpointEntry | None) -> None:
    """Copy a folder's files, again where a training that goes on there took one away meanwhile.

    Raises:
        OSError: It cannot be read or written.
    """
    for again in (True, True, False):
        try:
            shutil.copytree(source.path, copy, ignore=_passed_over(source, chosen), symlinks=False)
            return
        except shutil.Error:
            if not again:
                raise
            shutil.rmtree(copy)


def _passed_over(source: RunFolder, chosen: CheckpointEntry | None):  # type: ignore[no-untyped-def]
    """Return what `shutil.copytree` asks about each folder: the names in it that stay behind."""

    def passed_over(folder: str, names: list[str]) -> list[str]:
        passed = [name for name in names if name.endswith(PART)]  # which somebody is just writing
        if Path(folder) == source.path:
            passed += [name for name in names if name in (LOCK, STOP)]
        if chosen is not None and Path(folder) == source.checkpoints:
            passed += [name for name in names if name != chosen.policy]
        return passed

    return passed_over


def _keep_only(folder: Path, chosen: CheckpointEntry) -> None:
    """Write an index in which one checkpoint is all there is."""
    entry = {
        "iteration": chosen.iteration,
        "steps": chosen.steps,
        "score": chosen.score,
        "policy": chosen.policy,
        "state": None,
    }
    index = {"version": VERSION, "best": chosen.iteration, "last": chosen.iteration, "checkpoints": [entry]}
    write_atomic(folder / INDEX, json.dumps(index, indent=2) + "\n")
