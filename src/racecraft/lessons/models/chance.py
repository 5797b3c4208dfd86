"""Random numbers that Python and the browser draw alike: Mulberry32, 32 bits of state."""

from __future__ import annotations

MASK = 0xFFFFFFFF
STEP = 0x6D2B79F5


class Chance:
    """Draws numbers.

    >>> chance = Chance(1)
    >>> round(chance.share(), 6), chance.below(3)
    (0.627074, 0)

    Args:
        seed: 0 to 2^32 - 1.
    """

    def __init__(self, seed: int) -> None:
        self._state = seed & MASK

    def share(self) -> float:
        """Return a number in [0, 1)."""
        self._state = (self._state + STEP) & MASK
        mixed = self._state
        mixed = (mixed ^ mixed >> 15) * (mixed | 1) & MASK
        mixed ^= (mixed + ((mixed ^ mixed >> 7) * (mixed | 61) & MASK)) & MASK
        return (mixed ^ mixed >> 14) / 2**32

    def below(self, count: int) -> int:
        """Return a whole number in [0, count)."""
        return int(self.share() * count)
