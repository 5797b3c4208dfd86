"""Whole folders to a bucket and back. Begin with `push` and `pull`.

What stands on the other side already is passed over. Files that name others come after those they name, and the one
that makes a folder a run last of all: a transfer that is broken off leaves no index that points at nothing, and the
same command goes on where it was.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath

from racecraft.contract.errors import UserInputError
from racecraft.formats.checkpoint import INDEX
from racecraft.formats.run_folder import JOB, LIVE, STOP, WATCHED, RunFolder
from racecraft.formats.run_lock import LOCK
from racecraft.storage.address import Address, BucketError, file_of, require_files
from racecraft.storage.etags import is_same
from racecraft.storage.object_store import PARTIAL, NetworkError, Objects, StoredObject

MessageCallback = Callable[[str], None]
Chosen = Callable[[str], bool]

MIRROR = "mirror.json"
"""File of a run folder that says in which bucket it is kept as well; see `mirror_note.py`."""
PASSED_OVER = frozenset({LOCK, STOP, WATCHED, LIVE, MIRROR})
"""Files of a run folder that are about this machine and this moment."""
INDEXES = frozenset({INDEX, "deepracer_checkpoints.json", "checkpoint", ".coach_checkpoint", ".finished"})
"""Files that name others, ours and those of AWS's trainer."""


@dataclass(frozen=True)
class Transfer:
    """What a transfer came to."""

    moved: tuple[str, ...]
    """Names of what was moved, in that order."""
    skipped: int
    """How many stood on the other side already."""
    bytes: int
    """Of what was moved."""


def push(
    store: Objects,
    source: Path,
    target: Address,
    *,
    dry_run: bool = False,
    on_message: MessageCallback = lambda text: None,
) -> Transfer:
    """Put a folder's files below an address, or one file.

    Args:
        store: Where to.
        source: A folder, whose files get the same names below the address; or a file, which keeps its name.
        target: A bucket and a prefix.
        dry_run: Say what would be done, and do nothing.
        on_message: Called for each file that is moved.

    Raises:
        UserInputError: There is nothing to put, or it cannot be read.
        BucketError: The store refuses it, or a file's name is no key that could come back.
        NetworkError: The network failed for too long; what has arrived stays.
    """
    files = {source.name: source} if source.is_file() else files_below(source)
    if not files:
        what = "holds no files" if source.is_dir() else "there is no such folder or file"
        raise UserInputError(
            "{source}: {what}; expected what is to be put into {target}.", source=source, what=what, target=target
        )
    require_files(files)
    there = store.listed(target)
    mover = _Mover(len(files), dry_run, on_message, f"from {source} to {target}")
    for name in in_order(files):
        path = files[name]
        if name in there and is_same(path, there[name].size, there[name].etag):
            mover.skip()
        else:
            key = target.key(name)
            mover.move(name, path.stat().st_size, partial(store.put, target.bucket, key, path))
    return mover.result()


def pull(
    store: Objects,
    source: Address,
    target: Path,
    *,
    chosen: Chosen = lambda name: True,
    dry_run: bool = False,
    on_message: MessageCallback = lambda text: None,
) -> Transfer:
    """Fetch the objects below an address into a folder, or one object.

    Files that stand there under other names stay. Errors are those of `push`, and besides:

    Args:
        store: Where from.
        source: A bucket and a prefix, or the key of one object.
        target: The folder; made where there is none.
        chosen: Tells by its name whether an object is wanted.
        dry_run: Say what would be done, and do nothing.
        on_message: Called for each object that is moved.

    Raises:
        BucketError: There is nothing at the address, or an object's name cannot be a file here; nothing is written.
        RunFolderError: A training is under way in the folder.
        OutputFileError: A file cannot be written.
    """
    found = _found(store, source)
    names = [name for name in found if chosen(name) and PurePosixPath(name).name not in PASSED_OVER]
    wanted = {name: found[name][1] for name in names}
    if not wanted:
        raise BucketError(
            "{source}: there is nothing; expected a prefix that holds objects, or an object.", source=source
        )
    require_files(wanted)
    if target.is_dir() and (target / LOCK).exists():
        RunFolder(target).lock().release()  # refused while somebody trains there
    mover = _Mover(len(wanted), dry_run, on_message, f"from {source} to {target}")
    for name in in_order(wanted):
        stored, path = wanted[name], file_of(target, name)
        if is_same(path, stored.size, stored.etag):
            mover.skip()
        else:
            key = found[name][0]
            mover.move(name, stored.size, partial(store.get, source.bucket, key, stored, path))
    return mover.result()


def files_below(folder: Path) -> dict[str, Path]:
    """Return the files of a folder that are worth keeping elsewhere, by their name below it; links are none."""
    found = {}
    for path in folder.rglob("*"):
        if path.is_symlink() or not path.is_file() or is_passing(path.name):
            continue
        if not any(parent.is_symlink() for parent in path.parents if folder in parent.parents):
            found[path.relative_to(folder).as_posix()] = path
    return found


def is_passing(name: str) -> bool:
    """Tell a file that is about this moment only, or has not arrived whole."""
    return name in PASSED_OVER or name.endswith(".part") or PARTIAL in name


def in_order(names: Iterable[str]) -> list[str]:
    """Return names so that whatever names others comes behind them.

    >>> in_order(["job.json", "checkpoints/checkpoints.json", "log.txt", "checkpoints/0.policy.safetensors"])
    ['checkpoints/0.policy.safetensors', 'log.txt', 'checkpoints/checkpoints.json', 'job.json']
    """
    return sorted(names, key=lambda name: (name == JOB, PurePosixPath(name).name in INDEXES, name))


def _found(store: Objects, source: Address) -> dict[str, tuple[str, StoredObject]]:
    """Return key and facts of the objects at an address, by the name they get."""
    below = {name: (source.key(name), stored) for name, stored in store.listed(source).items()}
    if not below and source.prefix and (stored := store.find(source.bucket, source.prefix)) is not None:
        return {PurePosixPath(source.prefix).name: (source.prefix, stored)}
    return below


class _Mover:
    """Moves one after the other and counts; of a network that fails it says how far it came."""

    def __init__(self, total: int, dry_run: bool, on_message: MessageCallback, way: str) -> None:
        self._total, self._dry_run, self._on_message, self._way = total, dry_run, on_message, way
        self._moved: list[str] = []
        self._skipped = self._bytes = 0

    def skip(self) -> None:
        """Count one that stands already."""
        self._skipped += 1

    def move(self, name: str, size: int, act: Callable[[], None]) -> None:
        """Move one."""
        self._on_message(f"{'would move' if self._dry_run else 'moving'} {name} ({size} bytes)")
        if not self._dry_run:
            try:
                act()
            except NetworkError as error:
                stand = self._skipped + len(self._moved)
                far = f"On the way {self._way}, {stand} of {self._total} stand; the same command goes on from there."
                raise NetworkError("{error} {far}", error=error, far=far) from error
        self._moved.append(name)
        self._bytes += size

    def result(self) -> Transfer:
        """Return what it came to."""
        return Transfer(tuple(self._moved), self._skipped, self._bytes)
