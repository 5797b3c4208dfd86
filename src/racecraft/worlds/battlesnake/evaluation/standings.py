"""What came of many games: a table, strongest first, and who beat whom."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from racecraft.evaluation.rating import Rating, Result, rate, wilson


@dataclass(frozen=True)
class GameResult:
    """One game of a tournament."""

    number: int
    """From 1, in the order of the meetings."""
    players: tuple[int, ...]
    """Who sat at seats 0, 1 …: numbers of the tournament's players."""
    places: tuple[int, ...]
    """Where each seat ended, 0 the best; who left on the same turn shares a place."""
    turns: int
    timeouts: tuple[int, ...]
    """Moves that came late, of each seat."""
    crashes: tuple[int, ...]
    """Moves that failed otherwise, of each seat."""

    @property
    def result(self) -> Result:
        """The game as ratings read it."""
        return Result(self.players, self.places)

    @property
    def winner(self) -> int | None:
        """The player that outlived all others; None after a draw."""
        return self.players[self.places.index(0)] if self.places.count(0) == 1 else None


@dataclass(frozen=True)
class StandingsRow:
    """One line of the table."""

    name: str
    rating: Rating
    games: int
    wins: int
    """Games that this player alone survived, or outlived all others in."""
    win_rate_low: float
    win_rate_high: float
    """95 % interval of wins / games."""
    timeouts: int
    crashes: int


@dataclass(frozen=True)
class Score:
    """How one player fared against another: games in which it ended before it, with it, after it."""

    won: int = 0
    drawn: int = 0
    lost: int = 0

    def __str__(self) -> str:
        """Return it as `won-drawn-lost`."""
        return f"{self.won}-{self.drawn}-{self.lost}"


@dataclass(frozen=True)
class Table:
    """What came of a tournament, strongest first."""

    standings: list[StandingsRow]
    games: int
    turns: int
    head_to_head: dict[str, dict[str, Score]] = field(default_factory=dict)
    """For each player by name its score against each it has met."""
    games_planned: int = 0
    """How many the whole tournament has; more than `games` where it was broken off."""

    def to_dict(self) -> dict[str, Any]:
        """Return the table as plain JSON values."""
        return asdict(self)


def table_of(names: Sequence[str], games: Sequence[GameResult], planned: int) -> Table:
    """Return the table of these games.

    Args:
        names: The players, in the order of their numbers.
        games: What was played.
        planned: How many games the tournament has.
    """
    lines = []
    results = [game.result for game in games]
    for number, (name, rating) in enumerate(zip(names, rate(len(names), results), strict=True)):
        mine = [game for game in games if number in game.players]
        wins = sum(game.winner == number for game in mine)
        low, high = wilson(wins, len(mine))
        late = sum(game.timeouts[game.players.index(number)] for game in mine)
        failed = sum(game.crashes[game.players.index(number)] for game in mine)
        lines.append(StandingsRow(name, rating, len(mine), wins, low, high, late, failed))
    lines.sort(key=lambda line: -line.rating.points)
    turns = sum(game.turns for game in games)
    return Table(lines, len(games), turns, _head_to_head(names, games), planned)


def _head_to_head(names: Sequence[str], games: Sequence[GameResult]) -> dict[str, dict[str, Score]]:
    counts = {(a, b): [0, 0, 0] for a in range(len(names)) for b in range(len(names)) if a != b}
    for game in games:
        for a, place_a in zip(game.players, game.places, strict=True):
            for b, place_b in zip(game.players, game.places, strict=True):
                if a != b:
                    counts[a, b][0 if place_a < place_b else 1 if place_a == place_b else 2] += 1
    found: dict[str, dict[str, Score]] = {name: {} for name in names}
    for (a, b), count in counts.items():
        if any(count):
            found[names[a]][names[b]] = Score(*count)
    return found
