"""A file arrives whole, in one move, or not at all.

Begin with `write_atomic`. Writers that insist on a path of their own (Parquet) use `atomic_file`. Logs, which grow, are
continued by `append_atomic`, whose caller remembers how much of the log is sound.
"""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Iterator
from pathlib import Path

from racecraft.contract.errors import UserInputError

PART = ".part"
"""How the name of a file ends that is just being written."""


class OutputFileError(UserInputError):
    """A file could not be written; what stood there before still stands."""


def write_atomic(path: str | Path, data: bytes | str) -> None:
    """Put data at path in one move: a reader sees the old file or the new one, never half.

    Args:
        path: Where the file shall stand; its folder must exist.
        data: Bytes, or text that is written as UTF-8 with the line ends it holds.

    Raises:
        OutputFileError: The disk is full, or the place cannot be written. The old file, if any, is untouched.
    """
    with atomic_file(path) as part, open(part, "wb") as file:
        file.write(data.encode() if isinstance(data, str) else data)


@contextlib.contextmanager
def atomic_file(path: str | Path) -> Iterator[Path]:
    """Yield a path beside `path` to write to; on leaving, the written file takes its place in one move.

    Raises:
        OutputFileError: The disk is full, or the place cannot be written.
    """
    path = Path(path)
    part = path.with_name(path.name + PART)
    try:
        yield part
        _to_disk(part)
        os.replace(part, path)
    except OSError as error:
        _remove(part)
        raise OutputFileError(output_error(path, error)) from error
    except BaseException:
        _remove(part)
        raise
    _folder_to_disk(path.parent)


def append_atomic(path: str | Path, sound: int, data: bytes) -> int:
    """Continue a growing file: what stands behind its first `sound` bytes is cut off, and data follows.

    A crash on the way leaves a file whose first `sound` bytes are as they were, so the same call may be made again.

    Returns:
        How many bytes of the file are sound now; fewer than `sound` were kept where the file was shorter.

    Raises:
        OutputFileError: The disk is full, or the place cannot be written.
    """
    path = Path(path)
    try:
        with open(path, "r+b" if path.exists() else "w+b") as file:
            end = min(sound, file.seek(0, os.SEEK_END))
            file.truncate(end)
            file.seek(end)
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise OutputFileError(output_error(path, error)) from error
    return end + len(data)


def make_folder(path: str | Path) -> None:
    """Make a folder, and those above it, where they do not stand yet.

    Raises:
        OutputFileError: The place cannot be written, or a file stands in it.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputFileError(output_error(path, error)) from error


def _to_disk(path: Path) -> None:
    with open(path, "rb+") as file:
        os.fsync(file.fileno())


def _folder_to_disk(folder: Path) -> None:
    """Make the new name itself survive a power cut, where the system offers that."""
    if os.name == "nt":
        return
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _remove(part: Path) -> None:
    with contextlib.suppress(OSError):
        part.unlink()


def output_error(path: Path, error: OSError) -> str:
    """Return the error about a file that could not be written."""
    full = error.errno in (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))
    if full:
        return f"{path}: the disk is full; nothing was changed there. Free some space and run the same command again."
    if isinstance(error, FileNotFoundError):
        return f"{path}: its folder does not exist; expected an existing folder. Create {path.parent} first."
    reason = error.strerror or str(error)
    return f"{path}: cannot be written ({reason}); expected a file in a folder that you may write to."
