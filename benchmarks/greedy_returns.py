"""How a peer's network is judged: `mean_return` of whole episodes. Knows Gymnasium and nothing of anybody's library."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

JUDGED, CONFIRMED = 20, 100
"""Greedy episodes of a judgement, and of the one that confirms it."""


def mean_return(worlds: Any, act: Callable[[Any], Any], episodes: int, seed: int) -> float:
    """Return the mean return of that many episodes, as many of each of JUDGED worlds side by side.

    Args:
        worlds: A vector environment of JUDGED rows that begin again by themselves.
        act: From what is seen, (JUDGED, ...), to actions as the worlds obey them.
        episodes: How many, a multiple of JUDGED.
        seed: Of the worlds.
    """
    total, returns = np.zeros(JUDGED), [list[float]() for _ in range(JUDGED)]
    seen, _ = worlds.reset(seed=seed)
    while min(map(len, returns)) < episodes // JUDGED:
        seen, reward, terminated, truncated, _ = worlds.step(act(np.asarray(seen, np.float32)))
        total += reward
        for row in np.flatnonzero(terminated | truncated):
            returns[row].append(float(total[row]))
            total[row] = 0.0
    return float(np.mean([one[: episodes // JUDGED] for one in returns]))
