"""How often somebody may try: so many times within a minute. Begin with `Attempts`."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict, deque

from racecraft.accounts.people import AccountError


class TooManyAttemptsError(AccountError):
    """Somebody tried too often; later attempts are accepted again."""


class Attempts:
    """Counts attempts by key over a sliding window, in memory.

    Args:
        most: How many a key may make within the window.
        seconds: The window.
        kept: How many keys are remembered; the one used longest ago is forgotten first.
    """

    def __init__(self, most: int = 10, seconds: float = 60.0, kept: int = 10_000) -> None:
        self._most, self._seconds, self._kept = most, seconds, kept
        self._times: OrderedDict[str, deque[float]] = OrderedDict()
        self._lock = threading.Lock()

    def count(self, *keys: str) -> None:
        """Count one attempt for each key; one that is refused is not counted.

        Raises:
            TooManyAttemptsError: One of them has made too many.
        """
        now = time.monotonic()
        with self._lock:
            waits = [wait for key in keys if (wait := self._wait(key, now)) > 0]
            if not waits:
                for key in keys:
                    self._times[key].append(now)
            while len(self._times) > self._kept:
                self._times.popitem(last=False)
        if waits:
            raise TooManyAttemptsError(
                "Too many attempts; expected at most {most} in {seconds:g} s. Try again in {wait} s.",
                most=self._most, seconds=self._seconds, wait=int(max(waits)) + 1,
            )  # fmt: skip

    def clear(self, *keys: str) -> None:
        """Drop the attempts of keys that succeeded."""
        with self._lock:
            for key in keys:
                self._times.pop(key, None)

    def _wait(self, key: str, now: float) -> float:
        """Return how many seconds a key has to wait; 0.0: none."""
        times = self._times.setdefault(key, deque(maxlen=self._most))
        self._times.move_to_end(key)
        if len(times) < self._most:
            return 0.0
        return max(0.0, times[0] + self._seconds - now)
