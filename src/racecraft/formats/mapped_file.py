"""Large files that are looked at where they lie: arrays on the disk, a few megabytes of them in memory at a time.

Begin with `map_file`. What NumPy makes of its bytes is a view; a page comes into memory when it is touched and stays
there until `let_go`. Whoever goes through such an array in `pieces` never holds more of it than one piece.

A mapped file must not be cut short meanwhile: the system ends a process that touches what is gone.
"""

from __future__ import annotations

import mmap
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from racecraft.contract.world import Array

PIECE_BYTES = 2**23
"""What is looked at in one go."""


def map_file(path: str | Path) -> memoryview:
    """Return a file's bytes, which are read when they are looked at.

    Raises:
        OSError: It cannot be opened.
    """
    with open(path, "rb") as file:
        if os.fstat(file.fileno()).st_size == 0:
            return memoryview(b"")  # nothing cannot be mapped
        return memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))


def array_on_disk(shape: tuple[int, ...], dtype: type[np.generic]) -> Array:
    """Return an array of zeros that lies in a nameless file, and is gone with the last who holds it.

    Raises:
        OSError: The disk is full.
    """
    with tempfile.TemporaryFile(prefix="racecraft-array-") as file:
        return np.memmap(file, dtype, "w+", shape=shape)


def let_go(array: Array) -> None:
    """Take what was touched of a mapped array out of memory; it comes again when it is touched again.

    Of an array that lies in memory, nothing happens; nor where the system knows no such advice.
    """
    owner: object = array
    while isinstance(owner, np.ndarray):
        owner = owner.base
    if isinstance(owner, memoryview):
        owner = owner.obj
    if isinstance(owner, mmap.mmap) and hasattr(owner, "madvise"):
        owner.madvise(mmap.MADV_DONTNEED)


def spans(length: int, bytes_each: int) -> Iterator[slice]:
    """Yield slices that together are a length, of as many as a piece has room for.

    >>> list(spans(5, PIECE_BYTES // 2))
    [slice(0, 2, None), slice(2, 4, None), slice(4, 5, None)]
    """
    step = max(1, PIECE_BYTES // max(1, bytes_each))
    for begin in range(0, length, step):
        yield slice(begin, min(begin + step, length))


def pieces(array: Array) -> Iterator[Array]:
    """Yield the numbers of an array whose rows lie behind each other, flat and in pieces; each is let go behind it."""
    flat = array.reshape(-1)
    for part in spans(flat.size, flat.itemsize):
        yield flat[part]
        let_go(flat)
