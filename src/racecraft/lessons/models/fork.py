"""Now or later: a small prize near by on the left, a large one further away on the right, a cost for each step.

The numbers are those of Unity's Basic: 0.1 after 3 steps, 1.0 after 7, each step costs 0.01.
modules/fork.js has it too.
"""

from __future__ import annotations

from collections.abc import Callable

COST = 0.01
LEFT, RIGHT = (3, 0.1), (7, 1.0)
"""Steps and prize of each side."""


def worth(gamma: float, steps: int, prize: float, cost: float = COST) -> float:
    """Return the return of walking so many steps to a prize: the last step pays it, and every step costs something."""
    return gamma ** (steps - 1) * prize - cost * sum(gamma**k for k in range(steps))


def goes_right(gamma: float, cost: float = COST) -> bool:
    """Tell whether the large prize is worth more than the near one."""
    return worth(gamma, *RIGHT, cost) > worth(gamma, *LEFT, cost)


def turn() -> float:
    """Return the discount factor at which both sides are worth the same."""
    return _between(0.0, 1.0, goes_right)


def dearest(gamma: float) -> float:
    """Return the cost of a step at which both sides are worth the same; a dearer one sends the agent left."""
    return _between(0.0, 1.0, lambda cost: not goes_right(gamma, cost))


def _between(low: float, high: float, is_above: Callable[[float], bool]) -> float:
    """Return by halving where a condition begins to hold."""
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (low, middle) if is_above(middle) else (middle, high)
    return (low + high) / 2
