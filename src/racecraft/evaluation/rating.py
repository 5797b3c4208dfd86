"""Strength from results: Bradley and Terry's model, with intervals.

Two players' chance is a logistic of the difference of their ratings; 400 points apart means 10 to 1 (Elo's scale), and
the mean of all, or of the anchors where some are named, is 1500. All results count alike, whatever their order, because
the players do not change on the way.
A game of M snakes is M (M - 1) / 2 comparisons that hang together, so each counts 1 / (M - 1). A weak prior (a spread
of 400 points) keeps the rating of who never lost finite.

Intervals are 95 %: 1.96 standard deviations of the Laplace approximation at the most likely ratings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from racecraft.contract.world import Array

POINTS_PER_NAT = 400 / np.log(10)
PRIOR_SPREAD = 400 / POINTS_PER_NAT
MEAN = 1500.0


@dataclass(frozen=True)
class Rating:
    """A strength in Elo points with its 95 % interval."""

    points: float
    low: float
    high: float


@dataclass(frozen=True)
class Result:
    """Who met, and at which place each ended: 0 the best, equal places are draws."""

    players: tuple[int, ...]
    places: tuple[int, ...]
    steps: int = field(default=0, compare=False)
    """Moves that all of them made together; 0 where nobody counted."""


def rate(num_players: int, results: Sequence[Result], anchors: Sequence[int] = ()) -> list[Rating]:
    """Return every player's rating.

    >>> games = [Result((0, 1), (0, 1))] * 10 + [Result((0, 1), (1, 0))] * 10
    >>> [round(rating.points) for rating in rate(2, games)]
    [1500, 1500]

    Args:
        num_players: How many there are.
        results: Their games.
        anchors: Players whose mean is 1500, whoever else comes and goes; of all players where it is empty.
    """
    return [strength.rating for strength in strengths(wins_of(num_players, results), anchors)[0]]


@dataclass(frozen=True)
class Strength:
    """A strength as the model holds it, in nats above the anchors' mean, with its standard deviation."""

    nats: float
    spread: float

    @property
    def rating(self) -> Rating:
        """The same in Elo points."""
        low, mid, high = (float(MEAN + POINTS_PER_NAT * (self.nats + sign * 1.96 * self.spread)) for sign in (-1, 0, 1))
        return Rating(mid, low, high)


def strengths(wins: Array, anchors: Sequence[int] = ()) -> tuple[list[Strength], Array]:
    """Return the strength of every player, and how sure they are: the covariance of all strengths in nats, (P, P).

    Args:
        wins: What `wins_of` counts, (P, P).
        anchors: As for `rate`.
    """
    num_players = len(wins)
    found = np.zeros(num_players)
    for _ in range(50):
        slope, curvature = _slope(wins, found)
        step = np.linalg.solve(curvature, slope)
        found += step
        if np.abs(step).max(initial=0.0) < 1e-10:
            break
    scale = np.zeros(num_players)
    scale[list(anchors) or slice(None)] = 1.0 / (len(anchors) or max(1, num_players))
    centre = np.eye(num_players) - scale
    covariance = centre @ np.linalg.inv(_slope(wins, found)[1]) @ centre.T
    found = centre @ found
    spread = np.sqrt(np.maximum(0.0, np.diag(covariance)))
    return [Strength(*pair) for pair in zip(found.tolist(), spread.tolist(), strict=True)], covariance


def wilson(wins: float, games: int) -> tuple[float, float]:
    """Return the 95 % interval of a win rate (Wilson, 1927).

    >>> low, high = wilson(50, 100)
    >>> round(low, 3), round(high, 3)
    (0.404, 0.596)
    """
    if games == 0:
        return 0.0, 1.0
    z, share = 1.96, wins / games
    middle = share + z * z / (2 * games)
    half = z * np.sqrt(share * (1 - share) / games + z * z / (4 * games * games))
    scale = 1 + z * z / games
    return float((middle - half) / scale), float((middle + half) / scale)


def wins_of(num_players: int, results: Sequence[Result]) -> Array:
    """Return how often (weighted) the row's player ended before the column's, float64 (P, P); draws are halves."""
    wins = np.zeros((num_players, num_players))
    for result in results:
        weight = 1 / max(1, len(result.players) - 1)
        for a, place_a in zip(result.players, result.places, strict=True):
            for b, place_b in zip(result.players, result.places, strict=True):
                if a != b:
                    wins[a, b] += weight * (1.0 if place_a < place_b else 0.5 if place_a == place_b else 0.0)
    return wins


def _slope(wins: Array, strengths: Array) -> tuple[Array, Array]:
    """Return the gradient of the log posterior and minus its second derivative."""
    chance = 1 / (1 + np.exp(strengths[None, :] - strengths[:, None]))
    met = wins + wins.T
    slope = (wins - met * chance).sum(axis=1) - strengths / PRIOR_SPREAD**2
    weight = met * chance * (1 - chance)
    curvature = np.diag(weight.sum(axis=1) + 1 / PRIOR_SPREAD**2) - weight
    return slope, curvature
