"""Player 1: any move that is not surely fatal.

It has no plan at all, and still beats whoever runs into walls. Every other player should beat it.
"""

from __future__ import annotations

from typing import Literal

from racecraft.worlds.battlesnake.env.board import Board
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.safe_moves import safe_moves


class RandomSafe:
    """Rolls dice among the safe moves.

    Args:
        key: Stream key of its dice.
    """

    quick: Literal[True] = True

    def __init__(self, key: int = 0) -> None:
        self._dice = StreamDice(key)

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return a safe move, each as likely as the next; up where none is."""
        moves = safe_moves(board, settings, snake_id)
        return moves[self._dice.below(len(moves))] if moves else "up"
