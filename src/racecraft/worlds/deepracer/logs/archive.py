"""Log archives as they were downloaded: read member by member, never unpacked to the disk.

A `.tar.gz` that is a zip file in truth is read as well; the console handed such out.
"""

from __future__ import annotations

import io
import tarfile
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from racecraft.worlds.deepracer.logs.errors import LogError

WANTED = (".csv", ".json", ".log", ".yaml", ".parquet")
MOST_BYTES = 8 << 30
"""What an archive may unpack to, so that a bomb is refused before memory is full."""


@dataclass(frozen=True)
class MemberFile:
    """A file in an archive."""

    archive: Path
    name: str
    """Path in the archive."""
    data: bytes

    def __str__(self) -> str:
        """Return the archive and the path in it."""
        return f"{self.archive}/{self.name}"

    def read_bytes(self) -> bytes:
        """Return what the file holds."""
        return self.data


def is_archive(path: Path) -> bool:
    """Tell an archive by its first bytes, whatever it is called."""
    with open(path, "rb") as file:
        head = file.read(262)
    return head[:2] == b"\x1f\x8b" or head[:4] == b"PK\x03\x04" or head[257:262] == b"ustar" or head[:3] == b"BZh"


def members(path: Path) -> Iterator[MemberFile]:
    """Yield the files of an archive that may be logs.

    Raises:
        LogError: The archive is damaged or half downloaded, or unpacks to more than memory should hold.
    """
    expected = "a whole .tar.gz or .zip of logs"
    try:
        pieces = list(_zip(path) if zipfile.is_zipfile(path) else _tar(path))
    except (tarfile.TarError, zipfile.BadZipFile, EOFError, OSError, RuntimeError) as error:
        raise LogError(path, f"the archive is damaged ({error})", expected, "Download it again.") from error
    if sum(len(data) for _, data in pieces) > MOST_BYTES:
        raise LogError(path, "it unpacks to more than 8 GiB", expected, "Unpack it, and name the folder.")
    for name, data in pieces:
        yield MemberFile(path, name.removeprefix("./"), data)


def _wanted(name: str, size: int) -> bool:
    return size <= MOST_BYTES and (name.endswith(WANTED) or ".log." in name) and not Path(name).name.startswith("._")


def _tar(path: Path) -> Iterator[tuple[str, bytes]]:
    with tarfile.open(path, "r:*") as archive:
        for member in archive:
            if member.isfile() and _wanted(member.name, member.size):
                file = archive.extractfile(member)
                if file is not None:
                    yield member.name, file.read()


def _zip(path: Path) -> Iterator[tuple[str, bytes]]:
    with zipfile.ZipFile(io.BytesIO(path.read_bytes())) as archive:
        for info in archive.infolist():
            if not info.is_dir() and _wanted(info.filename, info.file_size):
                yield info.filename, archive.read(info)
