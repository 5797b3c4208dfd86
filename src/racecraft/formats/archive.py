"""Archives of unknown origin: `.tar`, `.tar.gz`, `.tar.bz2`, `.zip`. Begin with `members`; `unpack` writes them all.

An archive is read once, from front to back, in pieces of a megabyte. It is refused as soon as a name leads out of it, a
member is a link or a device, or it unpacks to more than its `Limits`: a zip before anything in it is unpacked, since
its directory states all sizes; a tar when that many bytes have been seen.
"""

from __future__ import annotations

import bz2
import gzip
import io
import re
import shutil
import stat
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePosixPath
from typing import IO, BinaryIO

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.formats.atomic import atomic_file, make_folder
from racecraft.formats.user_file import other_content, require_regular_file

PIECE = 2**20
MAX_HEADER = 8 * 2**20
"""Bytes that one read of a header may ask for."""
_Unpacked = BinaryIO | gzip.GzipFile | bz2.BZ2File
GZIPPED = (".tar.gz", ".tgz")
"""Endings of names of tars packed by gzip, which are all that is written here."""


@dataclass(frozen=True)
class _Packing:
    """How a tar may be packed."""

    magic: bytes
    """Its first bytes."""
    unpacked: Callable[[BinaryIO], _Unpacked]
    endings: tuple[str, ...]
    """Of names."""


_PACKINGS = {
    "gzip": _Packing(b"\x1f\x8b", lambda file: gzip.GzipFile(fileobj=file), GZIPPED),
    "bzip2": _Packing(b"BZh", bz2.BZ2File, (".tar.bz2",)),
}


class ArchiveError(InputFileError):
    """An archive cannot be used: not an archive, damaged, or dangerous."""


@dataclass(frozen=True)
class Limits:
    """What an archive may unpack to."""

    max_bytes: int = 16 * 2**30
    """All members together; consoles take archives of a gigabyte."""
    max_ratio: int = 100
    """Unpacked bytes for each packed one; texts of numbers come to ten."""
    free_bytes: int = 256 * 2**20
    """Unpacked bytes up to which `max_ratio` does not apply."""
    max_members: int = 100_000

    def check(self, path: str | Path, unpacked: int, packed: int, kind: str) -> None:
        """Refuse an archive that grows beyond the limits.

        Raises:
            ArchiveError: It does.
        """
        if unpacked > self.max_bytes:
            limit = f"{self.max_bytes >> 30} GiB" if self.max_bytes >= 2**30 else f"{self.max_bytes >> 20} MiB"
            raise ArchiveError(path, Message("it unpacks to more than {limit}", limit=limit), kind)
        if unpacked > self.free_bytes and unpacked > self.max_ratio * packed:
            found = Message(
                "its {packed} bytes unpack to more than {max_ratio} times as many",
                packed=packed,
                max_ratio=self.max_ratio,
            )
            raise ArchiveError(path, found, kind, "It was made to fill a disk.")


@dataclass(frozen=True)
class Member:
    """A plain file in an archive; to be read before the next one is asked for."""

    archive: Path
    kind: str
    """What the archive should be, as errors say it."""
    path: PurePosixPath
    """Its path in the archive; stays below any folder that it is joined to."""
    size: int
    """Bytes, as the archive states them."""
    stream: IO[bytes]

    def read(self) -> bytes:
        """Return what the file holds.

        Raises:
            ArchiveError: It is damaged.
        """
        with _damage_as_errors(self.archive, self.kind):
            return self.stream.read()

    def write(self, target: Path) -> Path:
        """Write the file to a path, whole or not at all; return the path.

        Raises:
            ArchiveError: It is damaged.
            OutputFileError: There is no room for it.
        """
        make_folder(target.parent)
        with _damage_as_errors(self.archive, self.kind), atomic_file(target) as part, open(part, "wb") as file:
            shutil.copyfileobj(self.stream, file, PIECE)
            if file.tell() != self.size:
                found = Message(
                    "'{name}' ends after {tell} of {size} bytes", name=target.name, tell=file.tell(), size=self.size
                )
                raise ArchiveError(self.archive, found, self.kind)
        return target


def is_archive(path: str | Path) -> bool:
    """Tell by its first bytes whether a file is an archive of a kind that is unpacked here."""
    path = Path(path)
    if not path.is_file():
        return False
    with open(path, "rb") as file:
        return kind_of(file) in (*_PACKINGS, "zip", "tar")


def without_ending(name: str) -> str:
    """Return a file's name without the ending of an archive.

    >>> without_ending("old-model.tar.gz"), without_ending("old-model.v2")
    ('old-model', 'old-model.v2')
    """
    for ending in (*(ending for one in _PACKINGS.values() for ending in one.endings), ".tar", ".zip"):
        name = name.removesuffix(ending)
    return name


def kind_of(file: BinaryIO) -> str:
    """Return "gzip", "bzip2", "zip" or "tar" by a file's first bytes, or in words what else it is."""
    head = file.read(512)
    file.seek(0)
    if head[257:262] == b"ustar":
        return "tar"
    kinds = {
        **{one.magic: name for name, one in _PACKINGS.items()}, b"PK\x03\x04": "zip", b"PK\x05\x06": "zip",
        b"\xfd7zXZ": "packed by xz", b"7z\xbc\xaf": "a 7z archive", b"Rar!": "a RAR",
    }  # fmt: skip
    return next(
        (kind for magic, kind in kinds.items() if head.startswith(magic)),
        other_content(head) or ("not an archive" if head else "empty"),
    )


def unpack(
    path: str | Path,
    into: str | Path,
    kind: str,
    limits: Limits | None = None,
    max_size_of: Callable[[PurePosixPath], int | None] | None = None,
) -> list[Path]:
    """Write files of an archive below a folder, and return their paths.

    Args:
        path: The archive.
        into: The folder; files in it are replaced.
        kind: What the archive should be, as errors say it.
        limits: What it may unpack to.
        max_size_of: The most bytes that a file may have, by its path in the archive; None: it is passed over.

    Raises:
        ArchiveError: As for `members`; or a file is too large, or stands in the archive twice.
        OutputFileError: There is no room for it.
    """
    written: dict[Path, None] = {}
    for member in members(path, kind, limits):
        limit = member.size if max_size_of is None else max_size_of(member.path)
        if limit is None:
            continue
        if member.size > limit:
            found = Message("'{place}' has {size} bytes", place=member.path, size=member.size)
            raise ArchiveError(path, found, Message("{limit} at most for such a file", limit=limit))
        target = Path(into) / member.path
        if target in written:
            raise ArchiveError(
                path, Message("'{name}' stands in it twice at the same place", name=target.name), "each file once"
            )
        written[member.write(target)] = None
    return list(written)


def members(source: str | Path | bytes, kind: str, limits: Limits | None = None) -> Iterator[Member]:
    """Yield the plain files of an archive, in its order.

    Args:
        source: A file, or the bytes of one.
        kind: What the archive should be, as errors say it.
        limits: What it may unpack to.

    Raises:
        ArchiveError: It is missing, not an archive, damaged or dangerous; or it grows beyond the limits.
    """
    path = Path("the archive") if isinstance(source, bytes) else Path(source)
    limits = limits or Limits()
    if not isinstance(source, bytes):
        require_regular_file(path, ArchiveError, kind)
    with _damage_as_errors(path, kind), io.BytesIO(source) if isinstance(source, bytes) else open(path, "rb") as file:
        packed = file.seek(0, io.SEEK_END)
        file.seek(0)
        what = kind_of(file)
        check = partial(limits.check, path, packed=packed, kind=kind)
        if what == "zip":
            yield from _zipped(file, path, kind, limits, check)
        elif what == "tar" or what in _PACKINGS:
            stream = file if what == "tar" else _PACKINGS[what].unpacked(file)
            yield from _tarred(_Guard(stream, path, kind, check), path, kind, limits)
        else:
            raise ArchiveError(path, what, kind)


@contextmanager
def _damage_as_errors(path: Path, kind: str) -> Iterator[None]:
    try:
        yield
    except FileNotFoundError:
        raise ArchiveError(path, "there is no such file", kind) from None
    except (tarfile.TarError, zipfile.BadZipFile, zlib.error, EOFError, gzip.BadGzipFile, struct.error) as error:
        raise ArchiveError(
            path, Message("damaged ({error})", error=error), kind, "Copy or download it again."
        ) from error
    except (NotImplementedError, RuntimeError) as error:  # zipfile's, of a password or an unknown packing
        raise ArchiveError(path, Message("cannot be unpacked ({error})", error=error), kind) from error
    except OSError as error:
        raise ArchiveError(
            path, Message("cannot be read ({strerror})", strerror=error.strerror or error), kind
        ) from error


class _Guard(io.RawIOBase):
    """The unpacked stream of a tar, read forwards only, whose size is checked."""

    def __init__(self, stream: _Unpacked, path: Path, kind: str, check: Callable[[int], None]) -> None:
        self._stream, self._path, self._kind, self._check, self._at = stream, path, kind, check, 0

    def read(self, size: int = -1) -> bytes:
        """Return the next bytes."""
        if not 0 <= size <= MAX_HEADER:
            raise ArchiveError(self._path, Message("a header in it asks for {size} bytes", size=size), self._kind)
        data = self._stream.read(size)
        self._count(len(data))
        return data

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Move forwards, by reading over what lies between."""
        if whence != io.SEEK_SET or offset < self._at:
            raise tarfile.ReadError(f"its parts lead back to byte {offset}")
        while self._at < offset:
            data = self._stream.read(min(PIECE, offset - self._at))
            if not data:
                raise tarfile.ReadError("it ends too early")
            self._count(len(data))
        return self._at

    def tell(self) -> int:
        """Return how much was read."""
        return self._at

    def seekable(self) -> bool:
        """Forwards."""
        return True

    def readable(self) -> bool:
        """Always."""
        return True

    def _count(self, more: int) -> None:
        self._at += more
        self._check(self._at)


def _tarred(guard: _Guard, path: Path, kind: str, limits: Limits) -> Iterator[Member]:
    with tarfile.open(fileobj=guard, mode="r:") as tar:
        for count, member in enumerate(tar):
            _require_few(path, kind, count + 1, limits)
            tar.members.clear()  # type: ignore[attr-defined]  # a list of them would grow with the archive
            if member.isdir():
                continue
            place = _safe_place(path, member.name)
            if member.issym() or member.islnk():
                raise ArchiveError(
                    path,
                    Message("'{name}' is a link to '{linkname}'", name=member.name, linkname=member.linkname),
                    "plain files only",
                )
            if not member.isreg() or member.issparse():
                what = "a sparse file" if member.issparse() else "a device or a pipe"
                raise ArchiveError(path, Message("'{name}' is {what}", name=member.name, what=what), "plain files only")
            stream = tar.extractfile(member)
            assert stream is not None
            yield Member(path, kind, place, member.size, stream)
    while guard.read(PIECE):  # gzip's checksum stands at its very end
        pass


def _zipped(file: IO[bytes], path: Path, kind: str, limits: Limits, check: Callable[[int], None]) -> Iterator[Member]:
    with zipfile.ZipFile(file) as archive:
        infos = archive.infolist()
        _require_few(path, kind, len(infos), limits)
        check(sum(info.file_size for info in infos))
        files = [(info, _safe_place(path, info.filename)) for info in infos if not info.is_dir()]
        for info, _ in files:
            if stat.S_IFMT(info.external_attr >> 16) not in (0, stat.S_IFREG):
                raise ArchiveError(
                    path, Message("'{filename}' is a link or a device", filename=info.filename), "plain files only"
                )
        for info, place in files:
            with archive.open(info) as stream:
                yield Member(path, kind, place, info.file_size, stream)


def _require_few(path: Path, kind: str, count: int, limits: Limits) -> None:
    if count > limits.max_members:
        raise ArchiveError(
            path, Message("it holds more than {max_members} members", max_members=limits.max_members), kind
        )


def _safe_place(path: Path, name: str) -> PurePosixPath:
    """Return a member's path, which stays below the folder that it is joined to.

    Raises:
        ArchiveError: It leads elsewhere.
    """
    place = PurePosixPath(name.replace("\\", "/"))
    if place.is_absolute() or ".." in place.parts or re.match(r"[A-Za-z]:", name) or "\0" in name:
        raise ArchiveError(
            path, Message("'{name}' leads out of the archive", name=name), "names inside it", "It was made to do harm."
        )
    return place
