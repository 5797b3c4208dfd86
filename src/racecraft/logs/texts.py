"""A file whose rows are wanted: `Text`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from racecraft.logs.sources import Source


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

    @cached_property
    def size(self) -> int:
        """Bytes of the file, asked once."""
        return self.source.size
