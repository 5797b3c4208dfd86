"""How often a lost player is started anew, in `mlagents-learn`'s words and with its defaults.

Begin at `RestartQuota`, one a player. A crash costs the player's episodes; a player that crashes again and again is no
accident, and an error.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from racecraft.contract.errors import UserInputError

UNLIMITED = -1


@dataclass(frozen=True)
class RestartLimits:
    """What is allowed each player; -1 is no limit."""

    max_lifetime_restarts: int = 10
    """New starts in all."""
    restarts_rate_limit_n: int = 1
    """New starts within one period."""
    restarts_rate_limit_period_s: float = 60.0
    """The period, in seconds."""

    def __post_init__(self) -> None:
        for name in ("max_lifetime_restarts", "restarts_rate_limit_n"):
            if getattr(self, name) < UNLIMITED:
                raise UserInputError(
                    "{name} is {problem}; expected a count, 0 for none, or -1 for no limit.",
                    name=name,
                    problem=getattr(self, name),
                )
        if self.restarts_rate_limit_period_s < 0:
            raise UserInputError(
                "restarts_rate_limit_period_s is {restarts_rate_limit_period_s}; expected seconds, 0 or more.",
                restarts_rate_limit_period_s=self.restarts_rate_limit_period_s,
            )


class RestartQuota:
    """One player's new starts.

    Args:
        limits: What is allowed.
        clock: Seconds that never run backwards.
    """

    def __init__(self, limits: RestartLimits, clock: Callable[[], float] = time.monotonic) -> None:
        self._limits, self._clock = limits, clock
        self._recent: deque[float] = deque()
        self.used = 0
        """New starts so far."""

    def use(self) -> str:
        """Use one new start.

        Returns:
            An empty string, or why there is none left and what to do, for an error message.
        """
        limits, now = self._limits, self._clock()
        while self._recent and now - self._recent[0] >= limits.restarts_rate_limit_period_s:
            self._recent.popleft()
        if UNLIMITED != limits.max_lifetime_restarts <= self.used:
            return (
                f"It was started anew {self.used} times before, and max_lifetime_restarts is "
                f"{limits.max_lifetime_restarts}; give more, or -1 for no limit."
            )
        if UNLIMITED != limits.restarts_rate_limit_n <= len(self._recent):
            return (
                f"It was started anew {len(self._recent)} times in the last {limits.restarts_rate_limit_period_s:g} s, "
                f"and restarts_rate_limit_n is {limits.restarts_rate_limit_n}; give more, or -1 for no limit."
            )
        self._recent.append(now)
        self.used += 1
        return ""
