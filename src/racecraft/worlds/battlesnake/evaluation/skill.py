"""Strength as OpenSkill counts it (Plackett and Luce's model), an open scale that others can compute again.

It is learned game by game, so the last games count a little more than the first; `rating.py` weighs all alike. A
newcomer stands at 25, and the interval is 95 %: 1.96 sigma to both sides.

Source: Joshy, "OpenSkill: a faster asymmetric multi-team, multiplayer rating system", 2024; the package `openskill`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from racecraft.evaluation.rating import Result


@dataclass(frozen=True)
class Skill:
    """What a player is believed to be worth, with the 95 % interval."""

    mu: float
    low: float
    high: float


class SkillBook:
    """Learns skills game by game, of players who may come at any time; numbers are theirs."""

    def __init__(self) -> None:
        from openskill.models import PlackettLuce

        self._model = PlackettLuce()
        self._known: list[Any] = []

    def hear(self, result: Result) -> None:
        """Learn from one game."""
        self._sized(max(result.players) + 1)
        teams = self._model.rate([[self._known[one]] for one in result.players], ranks=[*map(float, result.places)])
        for one, (rated,) in zip(result.players, teams, strict=True):
            self._known[one] = rated

    def skill(self, player: int) -> Skill:
        """Return what a player is believed to be worth by now."""
        self._sized(player + 1)
        mu, sigma = self._known[player].mu, self._known[player].sigma
        return Skill(mu, mu - 1.96 * sigma, mu + 1.96 * sigma)

    def _sized(self, players: int) -> None:
        self._known += [self._model.rating() for _ in range(players - len(self._known))]


def skills(num_players: int, results: Sequence[Result]) -> list[Skill]:
    """Return every player's skill after these games, in the order they were played.

    >>> strong, weak = skills(2, [Result((0, 1), (0, 1))] * 20)
    >>> strong.low > weak.high
    True
    """
    book = SkillBook()
    for result in results:
        book.hear(result)
    return [book.skill(player) for player in range(num_players)]
