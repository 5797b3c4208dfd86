"""Log archives as they were downloaded: their logs are read, and nothing is unpacked to the disk."""

from __future__ import annotations

import gzip
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from racecraft.formats import archive
from racecraft.worlds.deepracer.logs.errors import LogError

WANTED = (".csv", ".json", ".log", ".yaml", ".parquet")
LIMITS = archive.Limits(max_bytes=8 << 30)
"""What is read from an archive is held in memory."""


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


@dataclass(frozen=True)
class GzippedFile:
    """One file that was compressed by itself: NAME.csv.gz."""

    path: Path

    def __str__(self) -> str:
        """Return the path."""
        return str(self.path)

    @property
    def data(self) -> bytes:
        """What it holds.

        Raises:
            OSError: It is damaged, half downloaded, or unpacks to more than LIMITS.
        """
        try:
            with gzip.open(self.path) as file:
                data = file.read(LIMITS.max_bytes + 1)
        except EOFError as error:
            raise OSError(0, "cut short; download it again") from error
        if len(data) > LIMITS.max_bytes:
            raise OSError(0, f"more than {LIMITS.max_bytes >> 30} GiB")
        return data


def members(path: Path) -> Iterator[MemberFile]:
    """Yield the files of an archive that may be logs.

    Raises:
        LogError: The archive is damaged, half downloaded or dangerous, or unpacks to more than LIMITS.
    """
    kind = "a whole .tar.gz or .zip of logs"
    try:
        for member in archive.members(path, kind, LIMITS):
            if _is_wanted(member.path.name):
                yield MemberFile(path, str(member.path), member.read())
    except archive.ArchiveError as error:
        raise LogError(path, error.found, kind, error.hint) from error


def _is_wanted(name: str) -> bool:
    return (name.endswith(WANTED) or ".log." in name) and not name.startswith("._")
