"""A pupil's snake against one of ours: games on fresh seeds, the pupil's code in a process that can only compute."""

from __future__ import annotations

import random
import tempfile
from dataclasses import dataclass
from pathlib import Path

from racecraft.lessons.checking import AnswerError
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.match import play
from racecraft.worlds.battlesnake.evaluation.seats import take_seat
from racecraft.worlds.battlesnake.players.protocol import PlayerError

SETTINGS = GameSettings(players=2)
MAX_TURNS = 400


@dataclass(frozen=True)
class Duel:
    """What came out of several games."""

    won: int
    turns: int
    """Of all games together."""
    failed: int
    """Moves that the pupil's code did not give."""
    reason: str
    """What was wrong with the last of them."""


def duel(code: str, other: str, games: int) -> Duel:
    """Let code play games against a player of ours.

    Args:
        code: Python with `move(data)`.
        other: Name of the player.
        games: How many.

    Raises:
        AnswerError: The code does not load.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "snake.py"
        path.write_text(code, encoding="utf-8")
        try:
            own = take_seat(str(path), is_isolated=True)
        except PlayerError as error:
            raise AnswerError("Your code cannot be used: {error}", error=_without(path, str(error))) from None
        seats, keys = [own, take_seat(other, seed=random.getrandbits(32))], random.Random()
        try:
            played = [play(SETTINGS, seats, StreamDice(keys.getrandbits(60)), most_turns=MAX_TURNS)
                      for _ in range(games)]  # fmt: skip
        finally:
            for seat in seats:
                seat.leave()
    failures = own.failures
    won, turns = sum(one.winner == "s0" for one in played), sum(one.turns for one in played)
    return Duel(won, turns, failures.timeouts + failures.crashes, _without(path, failures.last_error))


def _without(path: Path, said: str) -> str:
    return said.replace(str(path), "your code")[:300]
