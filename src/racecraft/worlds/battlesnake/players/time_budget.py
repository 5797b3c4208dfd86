"""How much of a game's timeout a player has: the same in a server, where the way costs time, and beside the board."""

from __future__ import annotations

NETWORK_MARGIN_MS = 100
"""Kept of the timeout for the way there and back; at most half of it. Who sits beside the board keeps it too."""
THINKING_SHARE = 0.8
"""Share of the time for an answer that a player of ours is told to think."""


def seconds_to_answer(timeout_ms: float, margin_ms: float = NETWORK_MARGIN_MS) -> float:
    """Return the seconds within which a move has to be there.

    >>> seconds_to_answer(500), seconds_to_answer(100)
    (0.4, 0.05)
    """
    timeout_ms = max(1.0, timeout_ms)
    return (timeout_ms - min(margin_ms, timeout_ms / 2)) / 1000
