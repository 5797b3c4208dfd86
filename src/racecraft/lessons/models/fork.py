"""Now or later: a small prize near by on the left, a large one further away on the right, a cost for each step.

The numbers are those of Unity's Basic: 0.1 after 3 steps, 1.0 after 7, each step costs 0.01.
modules/fork.js has it too.
"""

from __future__ import annotations

COST = 0.01
LEFT, RIGHT = (3, 0.1), (7, 1.0)
"""Steps and prize of each side."""


def worth(gamma: float, steps: int, prize: float) -> float:
    """Return the return of walking so many steps to a prize: the last step pays it, and every step costs COST."""
    costs = sum(gamma**k for k in range(steps))
    return gamma ** (steps - 1) * prize - COST * costs


def turn() -> float:
    """Return the discount factor at which both sides are worth the same, by halving."""
    low, high = 0.0, 1.0
    for _ in range(50):
        middle = (low + high) / 2
        if worth(middle, *RIGHT) > worth(middle, *LEFT):
            high = middle
        else:
            low = middle
    return (low + high) / 2
