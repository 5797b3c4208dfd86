"""How sure a figure of a log is: 95 % intervals of correlations and of means."""

from __future__ import annotations

import math

import numpy as np

from racecraft.contract.world import Array

SIGMAS = 1.96


def correlation_interval(told: float | None, count: int) -> tuple[float, float]:
    """Return the interval of a correlation of so many pairs, by Fisher's transformation.

    >>> [round(end, 2) for end in correlation_interval(0.5, 103)]
    [0.34, 0.63]
    """
    if told is None or count < 4:
        return -1.0, 1.0
    middle, half = math.atanh(max(-0.999999, min(0.999999, told))), SIGMAS / math.sqrt(count - 3)
    return math.tanh(middle - half), math.tanh(middle + half)


def mean_interval(values: Array) -> tuple[float, float, float]:
    """Return a mean and its interval, by the normal distribution; without an end of fewer than two values.

    Args:
        values: (N,), one of each episode or lap.

    >>> [round(end, 2) for end in mean_interval(np.array([1.0, 2.0, 3.0, 4.0]))]
    [2.5, 1.23, 3.77]
    """
    mean = float(np.mean(values))
    half = SIGMAS * float(np.std(values, ddof=1)) / math.sqrt(len(values)) if len(values) > 1 else math.inf
    return mean, mean - half, mean + half
