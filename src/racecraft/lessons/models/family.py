"""One line each of four families: a temperature, a score of search, a slope by trying, and priorities.

modules/family.js has the first two as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence


def at_temperature(values: Sequence[float], temperature: float) -> list[float]:
    """Return the probability of each action by its value; a temperature is in the values' unit, above 0."""
    best = max(values)
    weights = [math.exp((value - best) / temperature) for value in values]
    return [weight / sum(weights) for weight in weights]


def search_scores(values: Sequence[float], priors: Sequence[float], visits: Sequence[int], c: float) -> list[float]:
    """Return `Q + c·P·√N / (1 + n)` of each move; the highest is tried next. Source: Silver et al., 2017."""
    root = math.sqrt(sum(visits))
    return [q + c * p * root / (1 + n) for q, p, n in zip(values, priors, visits, strict=True)]


def slope_by_trying(fitness: Callable[[float], float], theta: float, sigma: float) -> float:
    """Return an evolution strategy's slope from the pair of tries at theta ± sigma. Source: Salimans et al., 2017."""
    return (fitness(theta + sigma) - fitness(theta - sigma)) / (2 * sigma)


def priorities(errors: Sequence[float], exponent: float) -> list[float]:
    """Return how likely each step is to be replayed by its TD error. Source: Schaul et al., 2016."""
    weights = [abs(error) ** exponent for error in errors]
    return [weight / sum(weights) for weight in weights]
