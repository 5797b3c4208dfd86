"""Whether a file is the object already, told from the object's ETag without fetching it.

Of what was put in one piece, the ETag is the MD5 of the bytes. Of what was put in parts, it is the MD5 of the parts'
MD5s, a dash, and how many there were; the size of the parts is not told, so those that upload programs use are tried.
Stores that encrypt with keys of their own answer other ETags: then nobody can tell, and the object is moved again.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

from racecraft.contract.errors import UserInputError

PART_BYTES = 8 * 2**20
"""Parts that we put, and that `aws s3 cp` puts."""
_OTHER_PARTS = tuple(size * 2**20 for size in (5, 10, 15, 16, 32, 50, 64, 100, 128))


def is_same(path: Path, size: int, etag: str) -> bool:
    """Tell whether a file holds what an object of that size and ETag does; False where nobody can tell.

    Raises:
        UserInputError: The file cannot be read.
    """
    try:
        if not path.is_file() or path.stat().st_size != size:
            return False
        digest, _, parts = etag.strip('"').partition("-")
        if not parts:
            return md5_of(path) == digest
        return any(multipart_etag(path, part) == f"{digest}-{parts}" for part in _part_sizes(size, int(parts)))
    except ValueError:
        return False
    except OSError as error:
        raise UserInputError(
            "{path}: cannot be read ({strerror}); expected a file to compare.", path=path, strerror=error.strerror
        ) from error


def md5_of(path: Path) -> str:
    """Return the MD5 of a file, in hexadecimal digits."""
    digest = hashlib.md5(usedforsecurity=False)
    for block in _blocks(path, PART_BYTES):
        digest.update(block)
    return digest.hexdigest()


def multipart_etag(path: Path, part_bytes: int) -> str:
    """Return the ETag that a file has when it is put in parts of that size."""
    parts = [hashlib.md5(block, usedforsecurity=False).digest() for block in _blocks(path, part_bytes)]
    return f"{hashlib.md5(b''.join(parts), usedforsecurity=False).hexdigest()}-{len(parts)}"


def _part_sizes(size: int, parts: int) -> Iterator[int]:
    """Yield the sizes of parts, among the usual ones, of which so many make up the whole."""
    for part in (PART_BYTES, *_OTHER_PARTS):
        if -(-size // part) == parts:
            yield part


def _blocks(path: Path, size: int) -> Iterator[bytes]:
    with open(path, "rb") as file:
        while block := file.read(size):
            yield block
