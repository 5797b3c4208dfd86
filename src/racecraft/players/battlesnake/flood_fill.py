"""Player 3: counts the room behind each move, as water would find it.

A snake of length 12 that enters a pocket of 8 squares is dead, it just does not know yet. Pouring water onto the square
in front and counting where it runs tells. Bodies move away, too: the water takes one turn for each step, and a segment
k places before the tail is gone after k + 1 turns.
"""

from __future__ import annotations

from collections import deque

from racecraft.envs.battlesnake.board import MOVES, Board, Point
from racecraft.envs.battlesnake.settings import GameSettings
from racecraft.players.battlesnake.sight import find_snake, safe_moves, square_after, stronger_heads_near

HUNGRY_BELOW = 40
"""Health below which food comes first."""


class FloodFill:
    """Wants room for its whole body; then no stronger head nearby; then food, if hungry or shorter than another."""

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return the move that comes first in that order."""
        snake = find_snake(board, snake_id)
        others = [len(other.body) for other in board.alive() if other.id != snake_id]
        wants_food = snake.health < HUNGRY_BELOW or len(snake.body) <= max(others, default=0) + 1

        def worth(move: str) -> tuple[float, ...]:
            square = square_after(snake.head, move, board, settings)
            room, steps_to_food = pour(square, board, settings)
            enough = min(1.0, room / len(snake.body))
            threat = stronger_heads_near(square, board, settings, snake)
            return enough, -threat, -board.hazards.get(square, 0), -steps_to_food if wants_food else 0, room

        return max(safe_moves(board, settings, snake_id), key=worth, default="up")


def pour(start: Point, board: Board, settings: GameSettings) -> tuple[int, int]:
    """Return how many squares are reached from a square, and the steps to the nearest food (the area if none is)."""
    clear = turns_until_clear(board)
    food = set(board.food)
    steps = {start: 1}
    nearest_food = 0 if start in food else settings.area
    queue = deque([start])
    while queue:
        square = queue.popleft()
        for move in MOVES:
            beyond = square_after(square, move, board, settings)
            step = steps[square] + 1
            if beyond in steps or not board.holds(beyond) or clear.get(beyond, 0) > step:
                continue
            steps[beyond] = step
            queue.append(beyond)
            if beyond in food:
                nearest_food = min(nearest_food, step - 1)
    return len(steps), nearest_food


def turns_until_clear(board: Board) -> dict[Point, int]:
    """Return for each square under a living body in how many turns it may be entered, if nobody eats; a tail in 1."""
    clear: dict[Point, int] = {}
    for snake in board.alive():
        for place, square in enumerate(snake.body):
            clear[square] = max(clear.get(square, 0), len(snake.body) - place)
    return clear
