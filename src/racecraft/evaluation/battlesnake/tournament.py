"""Everyone against everyone: every group of players meets with the same dice at every rotation of its seats."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from racecraft.contract.random_streams import stream_keys
from racecraft.envs.battlesnake.board import BoardError
from racecraft.envs.battlesnake.dice import StreamDice
from racecraft.envs.battlesnake.settings import GameSettings
from racecraft.evaluation.battlesnake.match import Played, play
from racecraft.evaluation.battlesnake.rating import Rating, Result, rate, wilson
from racecraft.evaluation.battlesnake.seats import Seat
from racecraft.evaluation.battlesnake.skill import Skill, skills

MOST_TURNS = 1000
"""A game that lasts longer is a draw of all who live."""


@dataclass(frozen=True)
class Standing:
    """One line of the table."""

    name: str
    rating: Rating
    skill: Skill
    games: int
    wins: int
    """Games that this player alone survived, or outlived all others in."""
    win_rate_low: float
    win_rate_high: float
    """95 % interval of wins / games."""
    timeouts: int
    crashes: int


@dataclass(frozen=True)
class Table:
    """What came of a tournament, strongest first."""

    standings: list[Standing]
    games: int
    turns: int

    def to_dict(self) -> dict[str, Any]:
        """Return the table as plain JSON values."""
        return asdict(self)


def tournament(
    seats: Sequence[Seat],
    settings: GameSettings,
    rounds: int = 1,
    timeout_ms: int = 500,
    seed: int = 0,
    most_turns: int = MOST_TURNS,
    told: Callable[[Played, int, int], None] | None = None,
) -> Table:
    """Play a round robin.

    Args:
        seats: Who takes part; names differ.
        settings: What is played; `players` snakes sit at a board, so groups have that size.
        rounds: How many dice each group meets with; it plays `players` games with each, one a rotation of seats.
        timeout_ms: Time for an answer.
        seed: Chance of all games.
        most_turns: A longer game is a draw of all who live.
        told: Called after each game with it, its number from 1, and how many there are.

    Raises:
        BoardError: Fewer players than a board seats, or two of the same name.
    """
    names = [seat.name for seat in seats]
    if len(set(names)) < len(names):
        raise BoardError(f"players {', '.join(names)}; expected every name once.")
    if not 2 <= settings.players <= len(seats):
        raise BoardError(f"{settings.players} snakes a game among {len(seats)} players; expected 2 to {len(seats)}.")
    groups = list(itertools.combinations(range(len(seats)), settings.players))
    keys = stream_keys(seed, "snake tournament", len(groups) * rounds)
    meetings = [
        (group[turn:] + group[:turn], int(keys[number * rounds + one]))
        for one in range(rounds)
        for number, group in enumerate(groups)
        for turn in range(settings.players)
    ]
    results, turns = [], 0
    for number, (group, key) in enumerate(meetings, 1):
        players = [seats[one] for one in group]
        played = play(replace(settings), players, StreamDice(key), f"game-{number}", timeout_ms, most_turns=most_turns)
        results.append(Result(group, tuple(played.places())))
        turns += played.turns
        if told is not None:
            told(played, number, len(meetings))
    return Table(_standings(seats, results), len(results), turns)


def _standings(seats: Sequence[Seat], results: list[Result]) -> list[Standing]:
    lines = []
    strengths = zip(seats, rate(len(seats), results), skills(len(seats), results), strict=True)
    for number, (seat, rating, skill) in enumerate(strengths):
        mine = [result for result in results if number in result.players]
        wins = sum(result.places[result.players.index(number)] == 0 and result.places.count(0) == 1 for result in mine)
        low, high = wilson(wins, len(mine))
        failures = seat.failures
        lines.append(
            Standing(seat.name, rating, skill, len(mine), wins, low, high, failures.timeouts, failures.crashes)
        )  # fmt: skip
    return sorted(lines, key=lambda line: -line.rating.points)
