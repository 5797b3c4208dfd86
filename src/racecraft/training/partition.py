"""The worlds of a training in parts of equal worlds: cars of one course, then of the next. See `Partitionable`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable


@dataclass(frozen=True)
class Block:
    """Worlds of one part that are carried together."""

    first: int
    """Which of the part's worlds is the first of them."""
    count: int
    """How many they are; 0: none of this part."""
    of: int
    """How many the part has."""


@runtime_checkable
class Partitionable(Protocol):
    """A plan that says which of its worlds are alike, and that can be planned for some of them only."""

    @property
    def parts(self) -> tuple[int, ...]:
        """How many worlds each part has; worlds are numbered part by part."""
        ...

    def of_blocks(self, blocks: tuple[Block, ...]) -> Any:
        """Return the same plan for some of its worlds: a block of each part, in their order."""
        ...
