"""A run folder, kept in a bucket while it trains. See `Mirror`.

A thread of its own goes over the folder again and again: first the files, then the indexes as they were before the
files were looked at, so that an index in the bucket never names what is not there. The training waits for none of it.
A network that is slow costs sweeps, one that is broken is tried again later; what is missing in the end is said.
"""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from racecraft.contract.errors import UserInputError
from racecraft.formats.checkpoint import INDEX, Checkpoints
from racecraft.formats.run_folder import CHECKPOINTS, JOB
from racecraft.storage.address import Address
from racecraft.storage.etags import is_same
from racecraft.storage.object_store import NetworkError, Objects, StoredObject
from racecraft.storage.transfer import INDEXES, files_below

Stamp = tuple[int, int]
"""Size and moment of change of a file: the same as long as nobody wrote to it."""


@dataclass(frozen=True)
class Mirrored:
    """How far a mirror came."""

    missing: tuple[str, ...]
    """Files that the bucket lacks, or holds as they were before."""
    trouble: str
    """The letter about what went wrong last; empty: nothing."""


class Mirror:
    """Keeps one run folder in a bucket.

    Args:
        run: The run folder; it may be growing.
        target: Where to.
        store: Where the bucket is.
        rest_seconds: How long nothing is asked after the network was found broken.
        last_seconds: How long `close` waits for the rest to arrive.
    """

    def __init__(
        self,
        run: Path,
        target: Address,
        store: Objects,
        rest_seconds: float = 15.0,
        last_seconds: float = 60.0,
    ) -> None:
        self._run, self._target, self._store = run, target, store
        self._rest_seconds, self._last_seconds = rest_seconds, last_seconds
        self._there: dict[str, StoredObject] | None = None
        self._done: dict[str, Stamp] = {}
        self._trouble, self._rests_until = "", 0.0
        self._wake, self._closing = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._work, name="racecraft-mirror", daemon=True)
        self._thread.start()

    def changed(self) -> None:
        """Say that the folder has changed; returns at once."""
        self._wake.set()

    def close(self) -> Mirrored:
        """Have the rest mirrored, for so long as is waited, and say how far it came. Twice is once."""
        self._closing.set()
        self._wake.set()
        self._thread.join(self._last_seconds)
        if self._thread.is_alive() and not self._trouble:
            self._trouble = f"{self._target}: the network is slow; {self._last_seconds:g} seconds were not enough."
        return Mirrored(tuple(self._missing()), self._trouble)

    def _work(self) -> None:
        while True:
            self._wake.wait()
            closing = self._closing.is_set()  # asked before the sweep: what comes behind it is nobody's any more
            self._wake.clear()
            if closing or time.monotonic() >= self._rests_until:
                self._try_sweep()
            if closing:
                return

    def _try_sweep(self) -> None:
        try:
            self._sweep()
            self._trouble = ""
        except UserInputError as error:
            self._trouble = str(error)
            self._rests_until = time.monotonic() + self._rest_seconds
        except Exception as error:  # a training that goes on is worth more than a mirror that is right about everything
            self._trouble = f"{self._target}: {type(error).__name__}: {error}"
            self._rests_until = time.monotonic() + self._rest_seconds

    def _sweep(self) -> None:
        indexes = self._indexes()
        named = self._named()
        if self._there is None:
            self._there = self._store.listed(self._target)
        files = {name: path for name, path in files_below(self._run).items() if name not in indexes}
        for name in sorted(files):
            if PurePosixPath(name).name not in INDEXES and name != JOB:
                self._put(name, files[name])
        if named <= set(self._done):  # else one was taken away meanwhile, and the index is a newer one already
            for name in sorted(indexes, key=lambda name: (name == JOB, name)):
                self._put_text(name, *indexes[name])
            self._drop_old(files)

    def _indexes(self) -> dict[str, tuple[bytes, Stamp]]:
        """Return the files that name others, as they are now."""
        found = {}
        for name, path in files_below(self._run).items():
            if PurePosixPath(name).name in INDEXES or name == JOB:
                stamp = _stamp(path)
                found[name] = (path.read_bytes(), stamp)
        return found

    def _named(self) -> set[str]:
        """Return the checkpoints that the index names, as `_done` calls them."""
        entries = Checkpoints(self._run / CHECKPOINTS).entries()
        return {f"{CHECKPOINTS}/{name}" for entry in entries for name in (entry.policy, entry.state) if name}

    def _put(self, name: str, path: Path) -> None:
        try:
            stamp = _stamp(path)
            if self._done.get(name) == stamp:
                return
            stored = (self._there or {}).get(name)
            if name in self._done or stored is None or not is_same(path, stored.size, stored.etag):
                self._store.put(self._target.bucket, self._target.key(name), path)
        except (OSError, UserInputError) as error:
            if isinstance(error, NetworkError) or path.exists():
                raise
            return  # a checkpoint that was taken away for a newer one
        self._done[name] = stamp

    def _put_text(self, name: str, data: bytes, stamp: Stamp) -> None:
        if self._done.get(name) != stamp:
            self._store.write(self._target.bucket, self._target.key(name), data)
            self._done[name] = stamp

    def _drop_old(self, files: dict[str, Path]) -> None:
        """Take checkpoints out of the bucket that the run has taken away itself; no index names them any more."""
        ours = set(self._done) | set(self._there or {})
        shelf = {name for name in ours if name.startswith(f"{CHECKPOINTS}/") and name.endswith(".safetensors")}
        gone = sorted(name for name in shelf - set(files) if not (self._run / name).exists())
        if gone and (self._run / CHECKPOINTS / INDEX).is_file():
            self._store.remove(self._target.bucket, [self._target.key(name) for name in gone])
            for name in gone:
                self._done.pop(name, None)
                (self._there or {}).pop(name, None)

    def _missing(self) -> list[str]:
        return sorted(name for name, path in files_below(self._run).items() if self._done.get(name) != _stamp(path))


def _stamp(path: Path) -> Stamp:
    status = path.stat()
    return status.st_size, status.st_mtime_ns
