"""What every snake should look at before it moves: where a move leads, what it would run into, whose head is near."""

from __future__ import annotations

from racecraft.worlds.battlesnake.env.board import MOVES, STEPS, Board, Point, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.protocol import PlayerError


def find_snake(board: Board, snake_id: str) -> Snake:
    """Return the snake that is to move.

    Raises:
        PlayerError: It is not on the board, or not alive.
    """
    for snake in board.snakes:
        if snake.id == snake_id and snake.alive and snake.body:
            return snake
    raise PlayerError("snake '{snake_id}' is not alive on this board.", snake_id=snake_id)


def is_wrapped(settings: GameSettings) -> bool:
    """Tell whether the board's edges are joined."""
    return settings.ruleset.startswith("wrapped")


def square_after(point: Point, move: str, board: Board, settings: GameSettings) -> Point:
    """Return the square a move leads to; off the board where the edges are not joined."""
    dx, dy = STEPS[MOVES.index(move)]
    x, y = point[0] + dx, point[1] + dy
    return (x % board.width, y % board.height) if is_wrapped(settings) else (x, y)


def blocked_squares(board: Board) -> set[Point]:
    """Return the squares of living bodies that will still be there after this move: all but tails that move on."""
    blocked: set[Point] = set()
    for snake in board.alive():
        blocked.update(snake.body[:-1])
    return blocked


def safe_moves(board: Board, settings: GameSettings, snake_id: str) -> list[str]:
    """Return the moves that are not surely fatal: no wall, no body, no starving and no deadly hazard.

    May be empty. A tail that leaves may be followed: `blocked_squares` holds a doubled tail's square, since its last
    but one segment lies there too.
    """
    snake = find_snake(board, snake_id)
    blocked = blocked_squares(board)
    found = []
    for move in MOVES:
        square = square_after(snake.head, move, board, settings)
        if board.holds(square) and square not in blocked and _survives(snake, square, board, settings):
            found.append(move)
    return found


def stronger_heads_near(square: Point, board: Board, settings: GameSettings, snake: Snake) -> int:
    """Return how many other heads, not shorter than this snake, could enter a square in this turn too."""
    return sum(
        any(square_after(other.head, move, board, settings) == square for move in MOVES)
        for other in board.alive()
        if other.id != snake.id and len(other.body) >= len(snake.body)
    )


def best_safe_move(board: Board, settings: GameSettings, snake_id: str) -> str:
    """Return a move without thinking: safe if any is, off dangerous heads and hazards, where most squares are open.

    It always answers, also for a snake that is not there ("up"); the server keeps it at hand for when time runs out.
    """
    try:
        snake, safe = find_snake(board, snake_id), safe_moves(board, settings, snake_id)
    except PlayerError:
        return "up"
    blocked = blocked_squares(board)

    def danger(move: str) -> tuple[int, int, int]:
        square = square_after(snake.head, move, board, settings)
        beyond = (square_after(square, next_move, board, settings) for next_move in MOVES)
        ways_on = sum(board.holds(point) and point not in blocked for point in beyond)
        return stronger_heads_near(square, board, settings, snake), board.hazards.get(square, 0), -ways_on

    return min(safe or MOVES, key=danger)


def _survives(snake: Snake, square: Point, board: Board, settings: GameSettings) -> bool:
    if square in board.food:
        return True
    return snake.health - 1 - board.hazards.get(square, 0) * settings.hazard_damage > 0
