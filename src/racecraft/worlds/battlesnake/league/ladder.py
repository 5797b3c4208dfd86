"""What the games of an arena say: ratings on the anchors' scale, and who met whom. See `Ladder`.

Duels and games of more are counted apart and together: who is strong in the one need not be in the other. The mean of
the anchors is 1500, so that points mean the same whoever else comes and goes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.evaluation.rating import Rating, Strength, strengths, wilson, wins_of
from racecraft.worlds.battlesnake.evaluation.standings import Score
from racecraft.worlds.battlesnake.league.terms import ArenaGame, Entrant

TOGETHER = 0
"""The size of a board under which all games are counted."""


@dataclass(frozen=True)
class Rung:
    """One line of the table."""

    number: int
    name: str
    source: str
    is_anchor: bool
    rests: bool
    rating: Rating
    games: int
    wins: int
    """Games in which this player outlived all others."""
    win_rate_low: float
    win_rate_high: float
    """95 % interval of wins / games."""
    timeouts: int
    crashes: int

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain JSON values."""
        return asdict(self)


class Ladder:
    """Counts the games of an arena as they come.

    Args:
        sizes: Snakes at a board that are counted apart.
    """

    def __init__(self, sizes: Sequence[int]) -> None:
        self.sizes = tuple(sizes)
        self.last_game = 0
        """Number of the last game that was heard of."""
        self._counts = {size: _Counts() for size in (TOGETHER, *sizes)}

    def count(self, games: Iterable[ArenaGame]) -> None:
        """Count games, in their order."""
        for game in games:
            for size in (TOGETHER, len(game.players)):
                if size in self._counts:
                    self._counts[size].count(game)
            self.last_game = game.number

    def games(self, size: int = TOGETHER) -> int:
        """Return how many games of a size were counted."""
        return self._counts[size].games

    def strengths(self, entrants: Sequence[Entrant], size: int = TOGETHER) -> tuple[list[Strength], Array]:
        """Return what every player is thought to be worth, and the covariance of that."""
        anchors = [one.number for one in entrants if one.is_anchor]
        return strengths(self._counts[size].sized(len(entrants)).wins, anchors)

    def met(self, entrants: Sequence[Entrant], size: int = TOGETHER) -> Array:
        """Return how often two players met, int64 (P, P)."""
        met: Array = self._counts[size].sized(len(entrants)).scores.sum(axis=2)
        return met

    def rungs(self, entrants: Sequence[Entrant], size: int = TOGETHER) -> list[Rung]:
        """Return the table, strongest first; of a size only those who played there, of all games everybody."""
        counts, (found, _) = self._counts[size].sized(len(entrants)), self.strengths(entrants, size)
        lines = []
        for one, strength in zip(entrants, found, strict=True):
            games, wins, late, failed = counts.tallies[one.number].tolist()
            if games or size == TOGETHER:
                lines.append(Rung(
                    one.number, one.name, one.source, one.is_anchor, one.rests, strength.rating,
                    games, wins, *wilson(wins, games), late, failed,
                ))  # fmt: skip
        return sorted(lines, key=lambda line: -line.rating.points)

    def score(self, entrants: Sequence[Entrant], a: int, b: int, size: int = TOGETHER) -> Score:
        """Return how player `a` fared against `b`."""
        return Score(*self._counts[size].sized(len(entrants)).scores[a, b].tolist())


class _Counts:
    """Sums over games; arrays grow with the players."""

    def __init__(self) -> None:
        self.games = 0
        self.wins = np.zeros((0, 0))
        """How often the row's player ended before the column's, weighed as `rating.wins_of` does, (P, P)."""
        self.scores = np.zeros((0, 0, 3), np.int64)
        """Games the row's player won, drew and lost against the column's, (P, P, 3)."""
        self.tallies = np.zeros((0, 4), np.int64)
        """Games, wins, late moves and failed moves of each player, (P, 4)."""

    def sized(self, players: int) -> _Counts:
        """Make room for so many players."""
        more = players - len(self.tallies)
        if more > 0:
            self.wins = np.pad(self.wins, ((0, more), (0, more)))
            self.scores = np.pad(self.scores, ((0, more), (0, more), (0, 0)))
            self.tallies = np.pad(self.tallies, ((0, more), (0, 0)))
        return self

    def count(self, game: ArenaGame) -> None:
        self.sized(max(game.players) + 1)
        self.games += 1
        self.wins += wins_of(len(self.tallies), [game.result])
        for seat, player in enumerate(game.players):
            won = game.winner == player
            self.tallies[player] += (1, won, game.timeouts[seat], game.crashes[seat])
            for other_seat, other in enumerate(game.players):
                if other_seat != seat:
                    way = game.places[seat] - game.places[other_seat]
                    self.scores[player, other, 1 + (way > 0) - (way < 0)] += 1
