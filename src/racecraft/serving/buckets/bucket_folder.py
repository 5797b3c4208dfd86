"""A folder as a bucket: each file is an object, its path below the folder the key. See `BucketFolder`.

A file arrives whole, in one move, or not at all, and so a reader never sees half of one. Links are neither followed nor
listed. What S3 keeps beside an object (metadata of one's own, tags, versions, rights) a folder has no place for.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
import threading
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from racecraft.serving.buckets.xml import S3Error
from racecraft.storage.address import BucketError, file_of
from racecraft.storage.transfer import is_passing

ARRIVING = ".racecraft-arriving"
"""Folder in a bucket in which files and parts arrive; it is no object's."""
_BLOCK = 1 << 20


@dataclass(frozen=True)
class FileObject:
    """An object as it is now."""

    key: str
    path: Path
    size: int
    etag: str
    """MD5 of its bytes, in hexadecimal digits."""
    modified: float
    """Seconds since 1970 (UTC)."""


class BucketFolder:
    """One bucket.

    Args:
        path: The folder.
        name: What the bucket is called.
    """

    def __init__(self, path: Path, name: str) -> None:
        self.path, self.name = path.resolve(), name
        self._digests: dict[Path, tuple[tuple[int, int, int], str]] = {}
        self._moving = threading.Lock()

    def keys(self, prefix: str = "") -> list[str]:
        """Return all keys that begin so, in S3's order: by their bytes."""
        top = self.path / prefix.rpartition("/")[0]
        if ".." in prefix.split("/") or not top.is_dir():
            return []
        found = []
        for folder, names, files in os.walk(top, followlinks=False):
            names[:] = [name for name in names if name != ARRIVING]
            place = Path(folder)
            for name in files:
                path = place / name
                if not is_passing(name) and not path.is_symlink():
                    key = path.relative_to(self.path).as_posix()
                    if key.startswith(prefix):
                        found.append(key)
        return sorted(found, key=lambda key: key.encode("utf-8", "surrogateescape"))

    def find(self, key: str) -> FileObject | None:
        """Return an object; None where there is none."""
        try:
            path = self._file(key)
            told = path.stat()
        except (S3Error, OSError):
            return None
        if path.is_symlink() or not path.is_file() or is_passing(path.name):
            return None
        return FileObject(key, path, told.st_size, self._digest(path, told), told.st_mtime)

    def is_folder(self, key: str) -> bool:
        """Tell whether a key that ends with a slash stands for a folder."""
        return key.endswith("/") and bool(key.strip("/")) and self._file(key.rstrip("/")).is_dir()

    def make_folder(self, key: str) -> None:
        """Make a folder of a key that ends with a slash, as the console does.

        Raises:
            S3Error: It cannot stand here.
        """
        with _refusals(key):
            self._file(key.rstrip("/")).mkdir(parents=True, exist_ok=True)

    def write(self, key: str, pieces: Iterable[bytes], md5: str = "") -> str:
        """Put an object and return its ETag; it stands whole or not at all.

        Args:
            key: Its key.
            pieces: Its bytes.
            md5: Digest that they must have, in hexadecimal digits; empty: any.

        Raises:
            S3Error: The key cannot be a file here, the body broke off, or its digest is another.
        """
        path = self._file(key)
        with self.arriving() as part, _refusals(key):
            etag = self.fill(part, pieces, md5)
            with self._moving:  # against a folder that is taken away because it has just become empty
                path.parent.mkdir(parents=True, exist_ok=True)
                os.replace(part, path)
        return etag

    @staticmethod
    def fill(part: Path, pieces: Iterable[bytes], md5: str = "") -> str:
        """Write a file that arrives; return the MD5 of its bytes.

        Raises:
            S3Error: The body broke off, or its digest is another.
        """
        digest = hashlib.md5(usedforsecurity=False)
        with _refusals(part.name), open(part, "wb") as file:
            for piece in pieces:
                digest.update(piece)
                file.write(piece)
            file.flush()
            os.fsync(file.fileno())
        if md5 and digest.hexdigest() != md5:
            raise S3Error(400, "BadDigest", "The body is not what its MD5 says; nothing was changed.")
        return digest.hexdigest()

    def require_key(self, key: str) -> None:
        """Refuse a key that can be no file here.

        Raises:
            S3Error: It is one.
        """
        self._file(key)

    def remove(self, key: str) -> None:
        """Take an object away, and folders that hold nothing any more; of one that is not there nothing is said."""
        path = self._file(key.rstrip("/"))
        with self._moving, _refusals(key):
            if not key.endswith("/") and not path.is_symlink() and path.is_file():
                path.unlink()
            with contextlib.suppress(OSError):  # one that still holds something
                for folder in [path, *path.parents]:
                    if folder == self.path:
                        break
                    if folder.is_dir():
                        folder.rmdir()

    @contextlib.contextmanager
    def arriving(self) -> Iterator[Path]:
        """Yield a file to write to on the bucket's own disk; what is left of it in the end is taken away."""
        place = self.path / ARRIVING
        with _refusals(""):
            place.mkdir(exist_ok=True)
            handle, name = tempfile.mkstemp(dir=place)
            os.close(handle)
        try:
            yield Path(name)
        finally:
            with contextlib.suppress(OSError):
                Path(name).unlink(missing_ok=True)
            with contextlib.suppress(OSError):
                place.rmdir()

    def _file(self, key: str) -> Path:
        """Return the file of a key.

        Raises:
            S3Error: It can be none here, or a link stands in its way.
        """
        try:
            path = file_of(self.path, key)
        except BucketError as error:
            raise S3Error(400, "InvalidArgument", str(error)) from None
        if ARRIVING in path.relative_to(self.path).parts:
            raise S3Error(400, "InvalidArgument", f"The key {key!r} is none of yours: files arrive there.")
        if not path.parent.resolve().is_relative_to(self.path):
            raise S3Error(403, "AccessDenied", f"The key {key!r} leads out of the bucket by a link.")
        return path

    def _digest(self, path: Path, told: os.stat_result) -> str:
        stamp = (told.st_size, told.st_mtime_ns, told.st_ino)
        known = self._digests.get(path)
        if known is not None and known[0] == stamp:
            return known[1]
        digest = hashlib.md5(usedforsecurity=False)
        with open(path, "rb") as file:
            while block := file.read(_BLOCK):
                digest.update(block)
        self._digests[path] = (stamp, digest.hexdigest())
        return digest.hexdigest()


@contextlib.contextmanager
def _refusals(key: str) -> Iterator[None]:
    """Say what the disk refuses as S3 would."""
    try:
        yield
    except (FileExistsError, NotADirectoryError, IsADirectoryError):
        letter = f"The key {key!r} would have to be a file and a folder at once; a bucket that is a folder holds one."
        raise S3Error(400, "InvalidRequest", letter) from None
    except OSError as error:
        raise S3Error(507, "InsufficientStorage", f"The disk refuses it: {error.strerror}.") from error
