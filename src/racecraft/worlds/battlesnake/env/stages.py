"""The rules, one named stage each; `rulesets.py` puts them into order.

A stage looks at the board and changes it in place. It is given the moves of this turn (None while the game is being set
up) and the `GameContext` the game is played on. Every stage sees the *old* turn number (facts: A.2, A.3).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from racecraft.worlds.battlesnake.env.board import MAX_HEALTH, MOVES, STEPS, Board, BoardError, Point, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings

Moves = Mapping[str, str]
"""A move for each living snake's id; unknown ids are ignored."""


@dataclass
class GameContext:
    """What a game has besides its board."""

    settings: GameSettings
    sides: list[int] = field(default_factory=list)
    """The game's list of royale shrinks, drawn once: 0 left, 1 right, 2 bottom, 3 top."""


Stage = Callable[[Board, Moves | None, GameContext], None]


def move(board: Board, moves: Moves | None, table: GameContext) -> None:
    """Put a new head in front of every living snake and take its last segment away. Reversing is allowed, and fatal."""
    _move(board, moves, wrapped=False)


def move_wrapped(board: Board, moves: Moves | None, table: GameContext) -> None:
    """As `move`; a head that leaves the board comes in again at the opposite edge."""
    _move(board, moves, wrapped=True)


def lose_health(board: Board, moves: Moves | None, table: GameContext) -> None:
    """Take one health from every living snake."""
    if moves is None:
        return
    for snake in board.alive():
        snake.health -= 1


def suffer_hazards(board: Board, moves: Moves | None, table: GameContext) -> None:
    """Let hazards under heads do their damage, once per stacked hazard; food on the square protects.

    Who falls to 0 leaves at once, with cause "hazard": before feeding and before any collision is looked at.
    """
    if moves is None:
        return
    for snake in board.alive():
        if snake.head in board.food:
            continue
        for _ in range(board.hazards.get(snake.head, 0)):
            snake.health = max(0, min(MAX_HEALTH, snake.health - table.settings.hazard_damage))
            if snake.health <= 0:
                _eliminate(board, snake, "hazard")
                break


def feed(board: Board, moves: Moves | None, table: GameContext) -> None:
    """Let living snakes whose head is on food eat: health 100, tail doubled. All heads on one food eat it."""
    eaten = set()
    for snake in board.alive():
        if snake.head in board.food:
            eaten.add(snake.head)
            snake.health = MAX_HEALTH
            snake.body.append(snake.body[-1])
    board.food = [point for point in board.food if point not in eaten]


def eliminate(board: Board, moves: Moves | None, table: GameContext) -> None:
    """Take out the starved and those off the board; then judge all collisions of the rest and apply them together."""
    if moves is None:
        return
    for snake in board.alive():
        if snake.health <= 0:
            _eliminate(board, snake, "out-of-health")
        elif not all(board.holds(point) for point in snake.body):
            _eliminate(board, snake, "wall-collision")
    standing = board.alive()
    verdicts = [(snake, _collision(snake, standing)) for snake in standing]
    for snake, (cause, by) in verdicts:
        if cause:
            _eliminate(board, snake, cause, by)


def shrink_safe_zone(board: Board, moves: Moves | None, table: GameContext) -> None:
    """Lay royale hazards anew: everything outside the rectangle that is left after the shrinks so far (facts: A.4)."""
    if moves is None:
        return
    every = table.settings.shrink_every
    if every < 1:
        raise BoardError("royale shrinks every {every} turns; expected at least 1 (--shrinkEveryNTurns).", every=every)
    board.hazards = outside_safe_zone(board, table.sides[: (board.turn + 1) // every])


def remove_food(board: Board, moves: Moves | None, table: GameContext) -> None:
    """Empty the board of food."""
    board.food = []


def always_grow(board: Board, moves: Moves | None, table: GameContext) -> None:
    """Give every snake, the eliminated too, full health, and double its tail unless it is doubled already."""
    for snake in board.snakes:
        snake.health = MAX_HEALTH
        if snake.body[-1] != snake.body[-2]:
            snake.body.append(snake.body[-1])


def at_most_one_alive(board: Board) -> bool:
    """Tell whether a game among several is over."""
    return len(board.alive()) <= 1


def none_alive(board: Board) -> bool:
    """Tell whether a solo game is over."""
    return not board.alive()


def outside_safe_zone(board: Board, sides: list[int]) -> Counter[Point]:
    """Return one hazard on every square outside what the shrinks leave."""
    left, right, bottom, top = 0, board.width - 1, 0, board.height - 1
    for side in sides:
        left, right = left + (side == 0), right - (side == 1)
        bottom, top = bottom + (side == 2), top - (side == 3)
    return Counter(p for p in board.squares() if not (left <= p[0] <= right and bottom <= p[1] <= top))


def default_move(body: list[Point], width: int, height: int) -> str:
    """Return the move of a snake that gave none: straight on (also across a wrapped edge), up from a stacked start.

    >>> default_move([(0, 3), (10, 3), (9, 3)], 11, 11)
    'right'
    """
    dx, dy = body[0][0] - body[1][0], body[0][1] - body[1][1]
    dx = -1 if dx == width - 1 else 1 if dx == 1 - width else dx
    dy = -1 if dy == height - 1 else 1 if dy == 1 - height else dy
    return MOVES[STEPS.index((dx, dy))] if (dx, dy) in STEPS else "up"


def _move(board: Board, moves: Moves | None, wrapped: bool) -> None:
    if moves is None:
        return
    for snake in board.alive():
        if not snake.body:
            raise BoardError("snake {id} has no body; expected at least one square.", id=snake.id)
        if snake.id not in moves:
            raise BoardError(
                "snake {id} is alive and has no move; expected one of {moves}.", id=snake.id, moves=", ".join(MOVES)
            )
    for snake in board.alive():
        name = moves[snake.id]
        if name not in MOVES:
            name = default_move(snake.body, board.width, board.height) if len(snake.body) > 1 else "up"
        dx, dy = STEPS[MOVES.index(name)]
        head = (snake.head[0] + dx, snake.head[1] + dy)
        if wrapped:
            head = (head[0] % board.width, head[1] % board.height)
        snake.body = [head, *snake.body[:-1]]


def _collision(snake: Snake, standing: list[Snake]) -> tuple[str, str]:
    """Return what the snake ran into and whose it was: itself first, then bodies, then heads; the longest first."""
    if snake.head in snake.body[1:]:
        return "snake-self-collision", snake.id
    others = sorted((other for other in standing if other is not snake), key=lambda other: -len(other.body))
    for other in others:
        if snake.head in other.body[1:]:
            return "snake-collision", other.id
    for other in others:
        if snake.head == other.head and len(snake.body) <= len(other.body):
            return "head-collision", other.id
    return "", ""


def _eliminate(board: Board, snake: Snake, cause: str, by: str = "") -> None:
    snake.cause, snake.by, snake.on = cause, by, board.turn + 1
