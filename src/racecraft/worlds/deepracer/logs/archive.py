"""Log archives as they were downloaded: their logs are read, and nothing is unpacked to the disk."""

from __future__ import annotations

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


def members(path: Path) -> Iterator[MemberFile]:
    """Yield the files of an archive that may be logs.

    Raises:
        LogError: The archive is damaged, half downloaded or dangerous, or unpacks to more than LIMITS.
    """
    kind = "a whole .tar.gz or .zip of logs"
    try:
        for member in archive.members(path, kind, LIMITS):
            if _is_wanted(member.place.name):
                yield MemberFile(path, str(member.place), member.read())
    except archive.ArchiveError as error:
        raise LogError(path, error.found, kind, error.hint) from error


def _is_wanted(name: str) -> bool:
    return (name.endswith(WANTED) or ".log." in name) and not name.startswith("._")
