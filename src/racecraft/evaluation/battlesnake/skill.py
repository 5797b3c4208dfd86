"""Strength as OpenSkill counts it (Plackett and Luce's model), an open scale that others can compute again.

It is learned game by game, so the last games count a little more than the first; `rating.py` weighs all alike. A
newcomer stands at 25, and the interval is 95 %: 1.96 sigma to both sides.

Source: Joshy, "OpenSkill: a faster asymmetric multi-team, multiplayer rating system", 2024; the package `openskill`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from racecraft.evaluation.rating import Result


@dataclass(frozen=True)
class Skill:
    """What a player is believed to be worth, with the 95 % interval."""

    mu: float
    low: float
    high: float


def skills(num_players: int, results: Sequence[Result]) -> list[Skill]:
    """Return every player's skill after these games, in the order they were played.

    >>> strong, weak = skills(2, [Result((0, 1), (0, 1))] * 20)
    >>> strong.low > weak.high
    True
    """
    from openskill.models import PlackettLuce

    model = PlackettLuce()
    known = [model.rating() for _ in range(num_players)]
    for result in results:
        teams = model.rate([[known[one]] for one in result.players], ranks=list(map(float, result.places)))
        for one, (rated,) in zip(result.players, teams, strict=True):
            known[one] = rated
    return [Skill(one.mu, one.mu - 1.96 * one.sigma, one.mu + 1.96 * one.sigma) for one in known]
