"""What a snake player is: promises alone. `find.py` finds one by name.

A player is asked for one move at a time and is told everything it may know: the board, the settings of the game, who it
is and how long it may think. It may keep nothing from move to move, and may be asked about many games at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple, Protocol, runtime_checkable

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array
from racecraft.worlds.battlesnake.env.board import Board
from racecraft.worlds.battlesnake.env.settings import GameSettings

Message = dict[str, Any]
"""The JSON object of the official API (facts: A.10); see `messages.py`."""


class PlayerError(UserInputError):
    """A player cannot be found, cannot be loaded, or failed to give a move."""


class LatePlayerError(PlayerError, TimeoutError):
    """A player did not answer in time."""


@runtime_checkable
class SnakePlayer(Protocol):
    """Whoever looks at a board."""

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return one of `board.MOVES`.

        Args:
            board: The position; eliminated snakes may be left out. The player does not change it.
            settings: What the game is played with.
            snake_id: Who the player is on this board; alive.
            seconds: Time to think. A player that knows its answer gives it at once.

        Raises:
            PlayerError: It has no move; the arena and the server then move for it.
        """
        ...


class MoveRequest(NamedTuple):
    """What one snake is asked: the first three arguments of `SnakePlayer.choose` in the order of a tuple."""

    board: Board
    snake_id: str
    """Who the player is on this board; alive."""
    settings: GameSettings


@runtime_checkable
class BatchPlayer(SnakePlayer, Protocol):
    """Whoever looks at many boards as cheaply as at one: a network with one forward pass for all of them.

    The server gathers the questions that wait at a moment and asks them together.
    """

    def choose_many(self, questions: Sequence[MoveRequest]) -> list[str]:
        """Return one of `board.MOVES` for every question, in their order.

        The boards may differ in everything: size, ruleset, number of snakes. Called by one thread at a time, with at
        least one question; what `choose` would answer is answered here too.

        Raises:
            PlayerError: It has no moves; the server then moves for all of these snakes.
        """
        ...


@runtime_checkable
class InlinePlayer(SnakePlayer, Protocol):
    """Whoever has its answer in less time than it takes to hand a question to a thread and back.

    The server asks it on the spot. It never waits for anything and does not look at the time.
    """

    quick: Literal[True]


@runtime_checkable
class MovePrior(Protocol):
    """Whoever can say of every snake on a board how likely it would choose each move: a guide for search."""

    def move_priors(self, board: Board, settings: GameSettings) -> Array | None:
        """Return for every living snake, in their order, the chances of its moves, float (M, 4), each row summing to 1.

        Moves are in the order of `board.MOVES`. None: it knows nothing of such boards, and had better not be heard.
        """
        ...


@runtime_checkable
class JsonPlayer(Protocol):
    """Whoever is asked in the official JSON instead of being shown a board."""

    def start(self, message: Message, seconds: float) -> None:
        """Be told that a game begins."""
        ...

    def move(self, message: Message, seconds: float) -> str:
        """Return one of `board.MOVES`, or raise a `PlayerError`."""
        ...

    def end(self, message: Message, seconds: float) -> None:
        """Be told that a game is over."""
        ...

    def close(self) -> None:
        """Let go of what it holds: a connection, a process. It is not asked again."""
        ...
