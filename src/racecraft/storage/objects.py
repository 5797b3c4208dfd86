"""One object up or down: whole or not at all, and where it was broken off it goes on.

Small ones go in one request. Of larger ones every part that has arrived stays where it is: up, in the store's own
unfinished upload; down, in a file beside the place, named by the ETag, so that parts of two objects never meet.
"""

from __future__ import annotations

import contextlib
import glob
import hashlib
import os
from collections.abc import Callable
from pathlib import Path

from racecraft.contract.errors import UserInputError
from racecraft.formats.whole import OutputFileError, make_folder, output_letter
from racecraft.storage.etags import PART_BYTES, is_same
from racecraft.storage.object_store import NoSuchObjectError, Objects, StoredObject, StoredPart
from racecraft.storage.retrying import Patience

PARTIAL = ".partial-"
"""What stands in the name of a file that has not arrived whole yet."""
MOST_PARTS = 10_000
Sleep = Callable[[float], object]


def put_file(store: Objects, bucket: str, key: str, path: Path, patience: Patience, sleep: Sleep) -> None:
    """Put a file, as long as it is now: of one that grows meanwhile, what is behind that is left for the next time.

    Raises:
        NetworkError: The network failed for longer than `patience`.
        BucketError: The store refuses it.
        UserInputError: The file cannot be read.
    """
    try:
        size = path.stat().st_size
        if size <= PART_BYTES:
            data = path.read_bytes()[:size]
            patience.keep_trying(lambda: store.write(bucket, key, data), sleep)
        else:
            _put_parts(store, bucket, key, path, size, patience, sleep)
    except OSError as error:
        raise UserInputError(f"{path}: cannot be read ({error.strerror}); expected a file to put.") from error


def get_file(
    store: Objects, bucket: str, key: str, told: StoredObject, path: Path, patience: Patience, sleep: Sleep
) -> None:
    """Fetch an object into a file, which takes its place in one move when all of it has come.

    Raises:
        NetworkError: The network failed for longer than `patience`, or the object was changed meanwhile.
        BucketError: The store refuses it.
        OutputFileError: The file cannot be written.
    """
    make_folder(path.parent)
    mark = hashlib.md5(told.etag.encode(), usedforsecurity=False).hexdigest()[:8]
    part = path.with_name(f".{path.name}{PARTIAL}{mark}")

    def read(begin: int) -> bytes:
        end = min(begin + PART_BYTES, told.size)
        return patience.keep_trying(lambda: store.read(bucket, key, begin, end, told.etag), sleep)

    try:
        _forget_others(part, path)
        begun = _append(part, told.size, read)
        if begun and not is_same(part, told.size, told.etag):
            part.unlink()  # what stood there was damaged, or the ETag is no MD5 and nobody can tell: all of it anew
            _append(part, told.size, read)
        os.replace(part, path)
    except OSError as error:
        raise OutputFileError(output_letter(path, error)) from error


def _append(part: Path, size: int, read: Callable[[int], bytes]) -> int:
    """Fetch what a file lacks of its size; return how much of it stood there before."""
    with open(part, "ab") as file:
        begun = at = min(file.tell(), size)
        file.truncate(at)
        while at < size:
            data = read(at)
            file.write(data)
            file.flush()
            at += len(data)
        os.fsync(file.fileno())
    return begun


def _put_parts(store: Objects, bucket: str, key: str, path: Path, size: int, patience: Patience, sleep: Sleep) -> None:
    part_bytes = max(PART_BYTES, -(-size // MOST_PARTS))
    name, there = patience.keep_trying(lambda: _begun(store, bucket, key), sleep)
    done: list[StoredPart] = []
    with open(path, "rb") as file:
        for number in range(1, -(-size // part_bytes) + 1):
            data = file.read(min(part_bytes, size - (number - 1) * part_bytes))
            if (arrived := there.get(number)) is not None and _holds(arrived, data):
                done.append(arrived)
                continue

            def put(number: int = number, data: bytes = data) -> StoredPart:
                return store.write_part(bucket, key, name, number, data)

            done.append(patience.keep_trying(put, sleep))

    def complete() -> None:
        try:
            store.complete_upload(bucket, key, name, done)
        except NoSuchObjectError:  # done already, and only the answer to that was lost
            told = store.find(bucket, key)
            if told is None or told.size != size:
                raise

    patience.keep_trying(complete, sleep)


def _begun(store: Objects, bucket: str, key: str) -> tuple[str, dict[int, StoredPart]]:
    """Return the upload that is gone on with, or a new one, and which of its parts have arrived."""
    begun = store.begun_upload(bucket, key)
    if begun is not None:
        with contextlib.suppress(NoSuchObjectError):  # somebody has just finished it
            return begun, store.parts(bucket, key, begun)
    return store.begin_upload(bucket, key), {}


def _holds(part: StoredPart, data: bytes) -> bool:
    return part.size == len(data) and part.etag == hashlib.md5(data, usedforsecurity=False).hexdigest()


def _forget_others(part: Path, path: Path) -> None:
    """Take away what came of the object when it was another."""
    for other in path.parent.glob(f".{glob.escape(path.name)}{PARTIAL}*"):
        if other != part:
            other.unlink()
