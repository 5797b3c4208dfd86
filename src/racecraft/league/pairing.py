"""Who should meet next: those of whose games most is learned.

A game between two tells the more, the less is known about the difference of their strengths and the less sure its
outcome is. With chance p of a win and variance v of the difference (in nats), the expected gain is
½ log(1 + p (1 - p) v), the same measure as in Bayesian experimental design (Chaloner and Verdinelli, "Bayesian
experimental design: a review", 1995). Nobody is left out for long: who has not played is least known of all.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from racecraft.contract.world import Array
from racecraft.evaluation.rating import Strength


def gains(strengths: Sequence[Strength], covariance: Array) -> Array:
    """Return what a game between two would tell, in nats, float64 (P, P); 0 of a player against itself.

    Args:
        strengths: What each player is thought to be worth.
        covariance: How sure that is, (P, P), as `rating.strengths` gives it.
    """
    nats = np.array([one.nats for one in strengths])
    chance = 1 / (1 + np.exp(nats[None, :] - nats[:, None]))
    own = np.diag(covariance)
    variance = np.maximum(0.0, own[:, None] + own[None, :] - 2 * covariance)
    gain: Array = 0.5 * np.log1p(chance * (1 - chance) * variance)
    return gain


def next_group(
    strengths: Sequence[Strength], covariance: Array, met: Array, able: Sequence[int], size: int
) -> list[int]:
    """Return the players of the next meeting.

    The most informative pair comes first; then, one by one, whoever adds most to those who are there. Among equals
    those who met least often, then those who came first.

    Args:
        strengths: What each player is thought to be worth.
        covariance: How sure that is, (P, P).
        met: How often two met, (P, P).
        able: Players who can play now, at least `size`.
        size: How many sit at a board.
    """
    expected_gains = np.round(gains(strengths, covariance), 9)

    def first(pair: tuple[int, int]) -> tuple[float, ...]:
        return float(expected_gains[pair]), -float(met[pair]), -pair[0], -pair[1]

    def adds(one: int) -> tuple[float, ...]:
        return float(expected_gains[one, group].sum()), -float(met[one, group].sum()), -one

    pairs: list[tuple[int, int]] = [(a, b) for a in able for b in able if a < b]
    group: list[int] = [*max(pairs, key=first)]
    while len(group) < size:
        group.append(max((one for one in able if one not in group), key=adds))
    return group
