"""Whether a server can take a game more and still answer every move in time; known by how long requests wait now."""

from __future__ import annotations

from racecraft.serving.loop_lag import LoopLag

MAX_LAG_SHARE = 0.5
"""Share of a move's time that requests may lastingly wait before they are read."""
MAX_WAIT_SHARE = 0.2
"""Share of a move's time that the request of a new game may have waited, behind others and before it was read.

A burst of starts shows by itself how many moves at once the machine can answer: a move costs no less than a start.
"""
MAX_LATE_SHARE = 0.1
"""Share of the latest moves that may have been answered late."""
LATE_RATE = 0.02
"""How quickly that share follows: it looks back at some fifty moves."""


class Admission:
    """Watches a server's waiting times.

    Args:
        lag: How long requests wait before they are read.
    """

    def __init__(self, lag: LoopLag) -> None:
        self._lag = lag
        self.late_share = 0.0
        """Of the latest moves."""

    def note_move(self, taken: float, allowed: float) -> None:
        """Take the seconds that a move took and those that it was allowed."""
        self.late_share += LATE_RATE * ((taken > allowed) - self.late_share)

    def is_too_busy(self, waited: float, allowed: float) -> bool:
        """Tell whether a game more would be answered late.

        Args:
            waited: Seconds since the request of the new game was read.
            allowed: Seconds for one of its moves.
        """
        return (
            self._lag.lasting_seconds > MAX_LAG_SHARE * allowed
            or waited + self._lag.lasting_seconds > MAX_WAIT_SHARE * allowed
            or self.late_share > MAX_LATE_SHARE
        )
