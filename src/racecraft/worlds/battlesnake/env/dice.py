"""Random draws that are passed in.

StreamDice   a counter-based stream: the kernel rolls the same numbers from the same key and counter
LoadedDice   a fixed row of rolls, for tests
"""

from __future__ import annotations

from collections.abc import Iterable, MutableSequence
from typing import Protocol, TypeVar

T = TypeVar("T")
_MASK = (1 << 64) - 1


class Dice(Protocol):
    """Something that rolls."""

    def below(self, count: int) -> int:
        """Return a number from 0 to `count` - 1, each as likely as the next; `count` is at least 1."""
        ...


class StreamDice:
    """Dice of one stream (see `contract.random_streams`); `counter` is the number of rolls so far.

    A roll takes the upper 32 bits of a draw times `count`; the bias is below count / 2**32.

    >>> StreamDice(7).below(6) == StreamDice(7).below(6)
    True
    """

    def __init__(self, key: int, counter: int = 0) -> None:
        self.key, self.counter = int(key), int(counter)

    def below(self, count: int) -> int:
        """Return a number from 0 to `count` - 1."""
        z = (self.key + (self.counter + 1) * 0x9E3779B97F4A7C15) & _MASK
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
        self.counter += 1
        return ((z ^ (z >> 31)) >> 32) * count >> 32


class LoadedDice:
    """Dice that fall as they are told, then always low; a roll beyond `count` falls on its highest face.

    >>> dice = LoadedDice([5, 5])
    >>> dice.below(6), dice.below(3), dice.below(6)
    (5, 2, 0)
    """

    def __init__(self, rolls: Iterable[int] = ()) -> None:
        self._rolls = list(rolls)

    def below(self, count: int) -> int:
        """Return the next number that was laid in, or 0."""
        return min(self._rolls.pop(0), count - 1) if self._rolls else 0


def shuffle(items: MutableSequence[T], dice: Dice) -> None:
    """Put items into a random order, in place (Fisher and Yates, from the end)."""
    for last in range(len(items) - 1, 0, -1):
        other = dice.below(last + 1)
        items[last], items[other] = items[other], items[last]


def sample(items: list[T], count: int, dice: Dice) -> list[T]:
    """Return `count` different items (all of them where there are fewer), in the order drawn; `items` is left alone."""
    rest = list(items)
    return [rest.pop(dice.below(len(rest))) for _ in range(min(count, len(rest)))]
