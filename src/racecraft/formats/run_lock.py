"""The right to write to a run folder: one holder at a time, and a process that is killed holds nothing. See `RunLock`.

The lock is the operating system's own, on a file in the folder that says who holds it and since when. `FileLock` is the
same for whatever else only one process at a time may write.
"""

from __future__ import annotations

import contextlib
import datetime
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

from racecraft.contract.errors import RunFolderError, UserInputError
from racecraft.formats.processes import is_alive

LOCK = "run.lock"

_LOCKED_BYTE = 1 << 20
"""Where Windows locks: far behind the text, so that others can still read who holds the folder."""


class FileLock:
    """The right that a lock file stands for. One holder at a time; a process that is killed holds nothing.

    Args:
        path: The lock file; made where there is none.
        taken: Returns the letter for whoever comes second, told who the holder is.

    Raises:
        UserInputError: Somebody holds it (what `taken` returns), or the place cannot be written.
    """

    def __init__(self, path: Path, taken: Callable[[str], UserInputError]) -> None:
        self.path = path
        try:
            self._handle: int | None = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise unwritable(self.path, error) from error
        if not _try_lock(self._handle):
            os.close(self._handle)
            raise taken(_holder(self.path))
        now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
        with contextlib.suppress(OSError):  # these words are for people: on a full disk it is held without them
            os.ftruncate(self._handle, 0)
            os.write(self._handle, json.dumps({"pid": os.getpid(), "since": now}).encode())
        _remember(self)

    def release(self) -> None:
        """Give the folder back. Doing so twice is doing so once."""
        if self._handle is not None:
            with contextlib.suppress(OSError):
                os.ftruncate(self._handle, 0)
            _unlock(self._handle)
            self.let_go()

    def let_go(self) -> None:
        """Close the file; called by itself (in a forked child) it leaves the lock with the parent."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
            _held.discard(self)

    def __enter__(self) -> FileLock:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


class RunLock(FileLock):
    """The right to write to a run folder."""

    def __init__(self, folder: Path) -> None:
        super().__init__(
            folder / LOCK,
            lambda holder: RunFolderError(
                "{folder}: another training holds it ({holder}); expected a free folder. "
                "Wait for it, stop it, or train into another folder.",
                folder=folder,
                holder=holder,
            ),
        )


_held: set[FileLock] = set()
_watching_forks = False


def _remember(lock: FileLock) -> None:
    """See to it that forked children do not keep the folder taken when this process is killed."""
    global _watching_forks
    _held.add(lock)
    if not _watching_forks and hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=_let_all_go)
        _watching_forks = True


def _let_all_go() -> None:
    for lock in list(_held):
        lock.let_go()


def _try_lock(handle: int) -> bool:
    """Lock the file for this opening of it; False when somebody else has."""
    try:
        if sys.platform == "win32":
            import msvcrt

            os.lseek(handle, _LOCKED_BYTE, os.SEEK_SET)
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
            os.lseek(handle, 0, os.SEEK_SET)
        else:
            import fcntl

            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _unlock(handle: int) -> None:
    if sys.platform == "win32":
        import msvcrt

        os.lseek(handle, _LOCKED_BYTE, os.SEEK_SET)
        msvcrt.locking(handle, msvcrt.LK_UNLCK, 1)
    else:
        import fcntl

        fcntl.flock(handle, fcntl.LOCK_UN)


def _holder(path: Path) -> str:
    try:
        holder = json.loads(path.read_text(encoding="utf-8"))
        return f"process {holder['pid']}, since {holder['since']}"
    except (OSError, ValueError, KeyError, TypeError):
        return "a process that has just begun"


def holder(folder: Path) -> int | None:
    """Return the process that holds a folder; None where nobody does."""
    return holder_of(folder / LOCK)


def holder_of(lock: Path) -> int | None:
    """Return the process that holds a lock file; None where nobody does. Looking takes nothing from anybody.

    A holder that was killed leaves its number behind, so it is asked whether such a process lives on this machine.
    """
    try:
        pid = int(json.loads(lock.read_text(encoding="utf-8"))["pid"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return pid if is_alive(pid) else None


def unwritable(path: Path, error: OSError) -> RunFolderError:
    """Return the error about a place that cannot be written to."""
    return RunFolderError(
        "{path}: cannot be written ({strerror}); expected a place that you may write to. "
        "Give another place, or mend its permissions.",
        path=path,
        strerror=error.strerror or error,
    )
