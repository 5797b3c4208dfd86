"""Two snakes meet in several games on fresh seeds. Begin with `duel`, in which a pupil's code can only compute."""

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
CODE_MS = 3000
"""Time that a pupil's code has for a move: a busy machine shall not count as a fault of the code."""
CODE = "snake.py"


@dataclass(frozen=True)
class Duel:
    """What came out of several games."""

    won: int
    """By the first."""
    lost: int
    turns: int
    """Of all games together."""
    failed: int
    """Moves that the first did not give."""
    reason: str
    """What was wrong with the last of them."""


def duel(code: str, other: str, games: int) -> Duel:
    """Let code play games against a player; it can compute and nothing else.

    Args:
        code: Python with `move(data)`.
        other: A player's name, or a run folder.
        games: How many.

    Raises:
        AnswerError: The code does not load, or the other is no snake.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / CODE
        path.write_text(code, encoding="utf-8")
        return meet(str(path), other, games, CODE_MS)


def meet(one: str, other: str, games: int, timeout_ms: int = 500) -> Duel:
    """Let two players meet, each a name, a run folder, a file or `search+` before one of them.

    Raises:
        AnswerError: One of them does not load.
    """
    keys = random.Random()
    try:
        seats = [take_seat(name, seed=keys.getrandbits(32), is_isolated=True) for name in (one, other)]
    except PlayerError as error:
        raise AnswerError("This cannot be used: {error}", error=_without(one, str(error))) from None
    try:
        played = [play(SETTINGS, seats, StreamDice(keys.getrandbits(60)), timeout_ms=timeout_ms, most_turns=MAX_TURNS)
                  for _ in range(games)]  # fmt: skip
    finally:
        for seat in seats:
            seat.leave()
    failures, winners = seats[0].failures, [one.winner for one in played]
    return Duel(
        winners.count("s0"), winners.count("s1"), sum(one.turns for one in played),
        failures.timeouts + failures.crashes, _without(one, failures.last_error),
    )  # fmt: skip


def _without(path: str, text: str) -> str:
    return text.replace(path, "your code" if path.endswith(CODE) else "the snake")[:300]
