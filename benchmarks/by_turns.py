"""Processor time of several steps, taken by turns, so that whatever else the machine does meets all of them alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

UNCOUNTED = 2
"""Turns at the beginning, in which things are compiled and fetched."""


def microseconds(steps: Mapping[str, Callable[[], None]], turns: int, units: int) -> dict[str, list[float]]:
    """Return µs of processor time for each of the `units` that a step does, turn by turn, by the steps' names."""
    spent: dict[str, list[float]] = {name: [] for name in steps}
    for turn in range(turns + UNCOUNTED):
        for name, step in steps.items():
            began = time.process_time()
            step()
            if turn >= UNCOUNTED:
                spent[name].append((time.process_time() - began) / units * 1e6)
    return spent
