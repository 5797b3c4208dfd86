"""Player 3: counts the room behind each move, as water would find it.

A snake of length 12 that enters a pocket of 8 squares is dead, it just does not know yet. Pouring water onto the square
in front and counting where it runs tells. Bodies move away, too: the water takes one turn for each step, and a segment
k places before the tail is gone after k + 1 turns.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

from racecraft.worlds.battlesnake.env.board import Board, Point
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.safe_moves import (
    find_snake,
    is_wrapped,
    safe_moves,
    square_after,
    stronger_heads_near,
)

HUNGRY_BELOW = 40
"""Health below which food comes first."""


class FloodFill:
    """Wants room for its whole body; then no stronger head nearby; then food, if hungry or shorter than another."""

    quick: Literal[True] = True

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return the move that comes first in that order."""
        snake = find_snake(board, snake_id)
        others = [len(other.body) for other in board.alive() if other.id != snake_id]
        wants_food = snake.health < HUNGRY_BELOW or len(snake.body) <= max(others, default=0) + 1
        clear = turns_until_clear(board)

        def worth(move: str) -> tuple[float, ...]:
            square = square_after(snake.head, move, board, settings)
            room, steps_to_food = pour(square, board, settings, clear)
            enough = min(1.0, room / len(snake.body))
            threat = stronger_heads_near(square, board, settings, snake)
            return enough, -threat, -board.hazards.get(square, 0), -steps_to_food if wants_food else 0, room

        return max(safe_moves(board, settings, snake_id), key=worth, default="up")


def pour(start: Point, board: Board, settings: GameSettings, clear: dict[int, int]) -> tuple[int, int]:
    """Return how many squares are reached from a square, and the steps to the nearest food (the area if none is).

    Args:
        start: A square of the board.
        board: The position.
        settings: Whether the edges are joined.
        clear: What `turns_until_clear` says of the board.
    """
    ways = neighbours(board.width, board.height, is_wrapped(settings))
    food = {y * board.width + x for x, y in board.food}
    source = start[1] * board.width + start[0]
    reached, edge, step = {source}, [source], 1
    steps_to_food = 0 if source in food else settings.area
    while edge:
        step += 1  # all squares of the edge were reached in one turn less
        beyond = [cell for square in edge for cell in ways[square] if clear.get(cell, 0) <= step]
        edge = [cell for cell in dict.fromkeys(beyond) if cell not in reached]
        reached.update(edge)
        if steps_to_food >= step and not food.isdisjoint(edge):
            steps_to_food = step - 1
    return len(reached), steps_to_food


def turns_until_clear(board: Board) -> dict[int, int]:
    """Return for each cell under a living body in how many turns it may be entered, if nobody eats; a tail in 1."""
    clear: dict[int, int] = {}
    for snake in board.alive():
        left = len(snake.body)
        for x, y in snake.body:
            cell = y * board.width + x
            if clear.get(cell, 0) < left:
                clear[cell] = left
            left -= 1
    return clear


@lru_cache(maxsize=64)
def neighbours(width: int, height: int, wrapped: bool) -> tuple[tuple[int, ...], ...]:
    """Return for each cell (y * width + x) the cells a move leads to."""
    found = []
    for cell in range(width * height):
        x, y = cell % width, cell // width
        around = [(x, y + 1), (x, y - 1), (x - 1, y), (x + 1, y)]
        if wrapped:
            around = [(column % width, row % height) for column, row in around]
        on_board = [(column, row) for column, row in around if 0 <= column < width and 0 <= row < height]
        found.append(tuple(row * width + column for column, row in on_board))
    return tuple(found)
