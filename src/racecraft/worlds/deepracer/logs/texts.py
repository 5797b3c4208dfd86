"""A file whose rows are wanted: `Text`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from racecraft.worlds.deepracer.logs.sources import OtherHeadError, Source


@dataclass(frozen=True)
class Text:
    """A file whose rows are wanted."""

    place: int
    """Index of the file among the table's files."""
    source: Source
    begin: int = 0
    """Byte at which the first line begins."""
    line: int = 1
    """Number of that line."""
    head: bytes = b""
    """What it is taken to begin with, up to `begin`, and was not looked at yet; empty: nothing is taken for granted."""

    @cached_property
    def size(self) -> int:
        """Bytes of the file, asked once."""
        return self.source.size

    def read_into(self, room: memoryview, begin: int) -> int:
        """Fill room with the file's bytes from one on; return how many there were.

        Raises:
            OtherHeadError: It begins otherwise.
        """
        return self.source.read_into(room, begin, self.head if begin == self.begin else b"")

    def read(self) -> bytes:
        """Return the rows.

        Raises:
            OtherHeadError: It begins otherwise.
        """
        whole = self.source.read()
        if not whole.startswith(self.head):
            raise OtherHeadError
        return whole[self.begin :]
