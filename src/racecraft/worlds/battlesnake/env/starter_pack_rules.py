"""How a snake of the starter pack moves and what comes of it: the pack's own rules, quirks included (facts: B.1).

    move       a meal makes a snake longer on its next move, not on this one; a snake begins as a single square and
               keeps its tail on its first two moves, however long it is
    outcome    what a snake's head met, looked at snake by snake; whom it kills dies when all have been looked at, so
               everyone who dies in a turn still blocks and kills in it. Only who left the board does not block.

Squares are (row, column), row 0 on top; moves are 0 up (row - 1), 1 down, 2 left, 3 right.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from racecraft.worlds.battlesnake.env.board import MAX_HEALTH

Square = tuple[int, int]
"""(row, column); row 0 is the top."""

STEPS: tuple[Square, ...] = ((-1, 0), (1, 0), (0, -1), (0, 1))

FREE = "Did not collide"
HIT_WALL = "Snake hit wall"
EATEN_ON_SQUARE = "Snake was eaten - same tile"
EATEN_IN_SWAP = "Snake was eaten - adjacent tile"
HIT_SELF = "Snake hit body - hit itself"
HIT_OTHER = "Snake hit body - hit other"
WAS_HIT = "Other snake hit body"
ATE_SNAKE = "Ate another snake"
STARVED, FORBIDDEN, DEAD = "Starved", "Forbidden move", "Dead"

FATAL = frozenset({HIT_WALL, EATEN_ON_SQUARE, EATEN_IN_SWAP, HIT_SELF, HIT_OTHER})
REWARD_OF = {
    HIT_WALL: "hit_wall",
    EATEN_ON_SQUARE: "was_eaten",
    EATEN_IN_SWAP: "was_eaten",
    HIT_SELF: "hit_self",
    HIT_OTHER: "hit_other_snake",
    WAS_HIT: "other_snake_hit_body",
    ATE_SNAKE: "ate_another_snake",
}
"""Reward key of each outcome that has one."""


@dataclass(eq=False)
class Snake:
    """A snake of the starter pack; two are the same only if they are one."""

    body: list[Square]
    """Squares from head to tail; empty once dead."""
    health: int = MAX_HEALTH
    facing: int | None = None
    """The last move; None before the first."""
    alive: bool = True
    turns: int = 0
    """Turns survived."""
    stacked: int = 2
    """Moves still to come on which the tail stays: two at the start, of a snake of any length."""
    fed: bool = False
    """Whether the tail stays on the next move because of a meal."""

    @property
    def head(self) -> Square:
        """The first square."""
        return self.body[0]

    @property
    def square_before(self) -> Square:
        """Where the head came from, judged by the last move."""
        if self.facing is None:
            return self.head
        step = STEPS[self.facing]
        return self.head[0] - step[0], self.head[1] - step[1]

    def move(self, action: int) -> bool:
        """Move one square; return whether the move was a forbidden one: straight back (it then goes straight on)."""
        forbidden = self.facing is not None and action == self.facing ^ 1
        self.facing = self.facing if forbidden else action
        step = STEPS[self.facing if self.facing is not None else action]
        keeps_tail = self.stacked > 0 or self.fed
        if self.stacked > 0:
            self.stacked -= 1
        else:
            self.fed = False
        self.body = [(self.head[0] + step[0], self.head[1] + step[1]), *(self.body if keeps_tail else self.body[:-1])]
        return forbidden

    def eat(self) -> None:
        """Take a food in."""
        self.fed, self.health = True, MAX_HEALTH

    def die(self) -> None:
        """Leave the board."""
        self.alive, self.body = False, []


def outcome(snake: Snake, snakes: Sequence[Snake], doomed: Collection[Snake], size: tuple[int, int]) -> str:
    """Return what a living snake's head met after all have moved.

    Args:
        snake: The one looked at.
        snakes: All of the game; the dead have no body.
        doomed: Those already looked at that will die of it; they count for everything but `WAS_HIT`.
        size: (rows, columns).
    """
    if not _on_board(snake.head, size):
        return HIT_WALL
    rivals = [other for other in snakes if other is not snake and other.alive]
    eaten: list[Snake] = []
    for meets, fate in ((_on_one_square, EATEN_ON_SQUARE), (_swapped, EATEN_IN_SWAP)):
        for rival in rivals:
            if meets(snake, rival):
                if len(rival.body) >= len(snake.body):
                    return fate
                eaten.append(rival)
    if snake.head in snake.body[1:]:
        return HIT_SELF
    blocking = (other for other in rivals if other not in eaten and _on_board(other.head, size))
    if sum(snake.head in other.body[1:] for other in blocking) == 1:
        return HIT_OTHER
    if any(other.head in snake.body[1:] for other in rivals if other not in doomed):
        return WAS_HIT
    return ATE_SNAKE if eaten else FREE


def facing_of(body: Sequence[Square]) -> int | None:
    """Return the move that led from the second square to the head; None where there is none."""
    if len(body) < 2:
        return None
    step = (body[0][0] - body[1][0], body[0][1] - body[1][1])
    return STEPS.index(step) if step in STEPS else None


def _on_board(square: Square, size: tuple[int, int]) -> bool:
    return 0 <= square[0] < size[0] and 0 <= square[1] < size[1]


def _on_one_square(snake: Snake, rival: Snake) -> bool:
    return snake.head == rival.head


def _swapped(snake: Snake, rival: Snake) -> bool:
    return snake.head == rival.square_before and rival.head == snake.square_before
