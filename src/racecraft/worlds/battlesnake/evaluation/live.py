"""A game held before an audience: at a pace, from the first position to the last, and every seat is left at its end."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Protocol

from racecraft.contract.random_streams import stream_keys
from racecraft.worlds.battlesnake.env.board import Board
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.match import Played, play
from racecraft.worlds.battlesnake.evaluation.seats import Seat
from racecraft.worlds.battlesnake.players.messages import GameCard


class StepObserver(Protocol):
    """Whoever is shown every position."""

    def show(self, board: Board, card: GameCard) -> None:
        """See a position."""

    def leave(self, finished: bool) -> None:
        """See no more: the game is finished, or was broken off and nothing is waited for."""


class Pace:
    """Keeps the time of a turn.

    Args:
        delay_seconds: Waited after each turn.
        least_seconds: What a turn lasts at least.
    """

    def __init__(self, delay_seconds: float, least_seconds: float) -> None:
        self._delay, self._least = delay_seconds, least_seconds
        self._shown_at = 0.0

    def show(self, board: Board, card: GameCard) -> None:
        """Wait as long as is left of the turn."""
        rest = self._shown_at + self._least - time.monotonic()
        if board.turn > 0 and max(rest, self._delay) > 0:
            time.sleep(max(rest, self._delay))
        self._shown_at = time.monotonic()

    def leave(self, finished: bool) -> None:
        """Nothing to do."""


class TurnLog:
    """Says every turn: where each snake went, how long it took, and how it left.

    Args:
        on_message: Called with one line a turn.
    """

    def __init__(self, on_message: Callable[[str], None]) -> None:
        self._on_message = on_message
        self._before: Board | None = None

    def show(self, board: Board, card: GameCard) -> None:
        """Say a turn."""
        parts = []
        for snake in board.snakes if self._before is not None else []:
            name = card.names.get(snake.id, snake.id)
            if snake.alive or snake.on == board.turn:
                fate = "" if snake.alive else f" ({snake.cause})"
                parts.append(f"{name} to {snake.head[0]},{snake.head[1]} in {card.latencies_ms[snake.id]} ms{fate}")
        self._before = board
        if parts:
            self._on_message(f"turn {board.turn}: {'; '.join(parts)}")

    def leave(self, finished: bool) -> None:
        """Nothing to do."""


def play_live(
    settings: GameSettings,
    seats: list[Seat],
    seed: int,
    timeout_ms: int,
    sequential: bool = False,
    most_turns: int | None = None,
    observers: Sequence[StepObserver] = (),
    delay_seconds: float = 0,
    least_seconds: float = 0,
) -> Played:
    """Play a game before observers, at a pace; whatever happens, seats and observers are left.

    Args:
        settings: What is played.
        seats: Who plays.
        seed: Chance of the game, and part of its name.
        timeout_ms: Time for an answer.
        sequential: Ask servers one after another.
        most_turns: Stop there.
        observers: Shown every position.
        delay_seconds: Waited after each turn.
        least_seconds: What a turn lasts at least.
    """
    everyone = [*observers, Pace(delay_seconds, least_seconds)]

    def show(board: Board, card: GameCard) -> None:
        for observer in everyone:
            observer.show(board, card)

    dice = StreamDice(int(stream_keys(seed, "snake game", 1)[0]))
    finished = False
    try:
        played = play(settings, seats, dice, f"racecraft-{seed}", timeout_ms, sequential, most_turns, show)
        finished = True
    finally:
        for seat in seats:
            seat.leave()
        for observer in everyone:
            observer.leave(finished)
    return played
