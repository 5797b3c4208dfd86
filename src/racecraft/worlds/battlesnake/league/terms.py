"""What an arena plays, who takes part in it, and a game that was played there."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.contract.errors import UserInputError
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.standings import GameResult

ANCHORS = ("random_safe", "hungry", "flood_fill", "area_control")
"""Built-in players whose rules never change and that need no time to think."""


class ArenaError(UserInputError):
    """An arena, or a player or game of it, cannot be used."""


@dataclass(frozen=True)
class ArenaTerms:
    """What an arena plays; the same from its first game to its last, or its ratings would mean nothing.

    Raises:
        ArenaError: A number is out of its range.
    """

    width: int = 11
    """Squares from left to right."""
    height: int = 11
    """Squares from bottom to top."""
    ruleset: str = "standard"
    """Official name of the rules."""
    map: str = "standard"
    """Official name of the map."""
    snakes: tuple[int, ...] = (2, 4)
    """Snakes at a board: duels and fours, as many games of each."""
    timeout_ms: int = 100
    """Time for an answer."""
    most_turns: int = 1000
    """A longer game is a draw of all who live."""
    seed: int = 0
    """Chance of all games."""

    def __post_init__(self) -> None:
        sizes = self.snakes
        if not sizes or len(set(sizes)) < len(sizes) or not all(2 <= one <= 8 for one in sizes):
            raise ArenaError(
                "snakes at a board {sizes}; expected different numbers from 2 to 8.",
                sizes=", ".join(map(str, sizes)) or "none",
            )
        if self.timeout_ms < 1 or self.most_turns < 1:
            raise ArenaError(
                "timeout {timeout_ms} ms, {most_turns} turns; expected at least 1 of both.",
                timeout_ms=self.timeout_ms,
                most_turns=self.most_turns,
            )

    def game(self, snakes: int) -> GameSettings:
        """Return the settings of a game of so many snakes. Raises BoardError where nobody can play that."""
        return GameSettings(self.width, self.height, snakes, self.ruleset, self.map)


@dataclass(frozen=True)
class Entrant:
    """A player of an arena."""

    number: int
    """From 0, in the order in which they came."""
    name: str
    """What it is called here; no two have the same."""
    source: str
    """Where it is found: a built-in name, an address, a FILE.py or a RUN with its checkpoint, maybe behind search+."""
    fingerprint: str = ""
    """Of the file or the weights as they were when it came in; "" where there are none, or nobody can see them."""
    is_anchor: bool = False
    """Whether it holds the scale."""
    rests: bool = False
    """Whether it is drawn no more; its games stay."""
    since: float = 0.0
    """When it came, in seconds of Unix time."""


@dataclass(frozen=True)
class Meeting:
    """Several players who meet with the same dice at every rotation of their seats."""

    number: int
    """From 1, in the order in which they were drawn."""
    players: tuple[int, ...]
    """Numbers of the players, in the order of their seats in the first game."""

    def seated(self, rotation: int) -> tuple[int, ...]:
        """Return who sits where in a game of it, rotations from 0.

        >>> Meeting(1, (4, 7, 9)).seated(1)
        (7, 9, 4)
        """
        return self.players[rotation:] + self.players[:rotation]


@dataclass(frozen=True)
class ArenaGame(GameResult):
    """One game of an arena, as its store tells it."""

    meeting: int = 0
    rotation: int = 0
    """Which of the meeting's games it is, from 0."""
    ended: float = 0.0
    """When it was over, in seconds of Unix time."""
