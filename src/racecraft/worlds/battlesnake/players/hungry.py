"""Player 2: straight to the nearest food.

It never starves and soon is long, and then it dies in a corner of its own making: it looks one move ahead only.
"""

from __future__ import annotations

from typing import Literal

from racecraft.worlds.battlesnake.env.board import Board, Point
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.safe_moves import find_snake, is_wrapped, safe_moves, square_after


class Hungry:
    """Takes the safe move that ends nearest to a food."""

    quick: Literal[True] = True

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return that move; with no food on the board, the first safe one."""
        head = find_snake(board, snake_id).head

        def steps_to_food(move: str) -> int:
            square = square_after(head, move, board, settings)
            return min((steps_between(square, food, board, settings) for food in board.food), default=0)

        return min(safe_moves(board, settings, snake_id), key=steps_to_food, default="up")


def steps_between(a: Point, b: Point, board: Board, settings: GameSettings) -> int:
    """Return how many moves two squares are apart when nothing is in the way."""
    dx, dy = abs(a[0] - b[0]), abs(a[1] - b[1])
    if is_wrapped(settings):
        dx, dy = min(dx, board.width - dx), min(dy, board.height - dy)
    return dx + dy
