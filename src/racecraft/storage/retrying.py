"""How long a network that fails is waited for. See `Patience`."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from racecraft.contract.errors import SettingError
from racecraft.storage.address import BucketError

T = TypeVar("T")


class NetworkError(BucketError):
    """A store did not answer, or broke off: what was asked may be asked again."""


@dataclass(frozen=True)
class Patience:
    """How often what failed is tried again.

    >>> list(Patience(tries=5, first_seconds=1.0, most_seconds=3.0).waits())
    [1.0, 2.0, 3.0, 3.0]
    """

    tries: int = 6
    """How often something is tried before it is given up."""
    first_seconds: float = 0.5
    """Seconds before the second try; each further wait is twice as long."""
    most_seconds: float = 10.0
    """Seconds no wait is longer than."""

    def __post_init__(self) -> None:
        """Refuse what cannot be waited."""
        if self.tries < 1 or self.first_seconds < 0 or self.most_seconds < self.first_seconds:
            raise SettingError(f"{self}: expected at least one try, and seconds that are not negative.")

    def waits(self) -> list[float]:
        """Return the seconds between the tries."""
        return [min(self.first_seconds * 2.0**number, self.most_seconds) for number in range(self.tries - 1)]

    def keep_trying(self, act: Callable[[], T], sleep: Callable[[float], object] = time.sleep) -> T:
        """Do something, again and again where the network fails.

        Raises:
            NetworkError: It failed each time.
        """
        for wait in self.waits():
            try:
                return act()
            except NetworkError:
                sleep(wait)
        return act()


FIRST_CONTACT = Patience(tries=3)
"""For the first question to a store: whoever mistyped its address shall hear of it soon."""
