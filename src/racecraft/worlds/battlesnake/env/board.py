"""A position on the board: snakes, food and hazards, as a person would describe it.

The referee (`reference.py`) plays on these values; the kernels play on `state.Games`, and `state.py` carries between.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from racecraft.contract.errors import UserInputError

Point = tuple[int, int]
"""A square (x, y); x to the right, y upward, (0, 0) bottom-left."""

MAX_HEALTH = 100
START_LENGTH = 3

MOVES = ("up", "down", "left", "right")
"""Names of the four moves; an action is an index into this row."""
STEPS: tuple[Point, ...] = ((0, 1), (0, -1), (-1, 0), (1, 0))
"""What each move adds to (x, y)."""

CAUSES = (
    "",
    "out-of-health",
    "wall-collision",
    "snake-self-collision",
    "snake-collision",
    "head-collision",
    "hazard",
)
"""How a snake may leave the game, in the words of the API; "" is alive. Kernels store the index."""


class BoardError(UserInputError):
    """A board, a size, a ruleset or a map cannot be played; the message says what to do."""


@dataclass
class Snake:
    """One snake; after its elimination it lies where it died."""

    id: str
    body: list[Point]
    """Squares from head to tail; stacked segments stand more than once."""
    health: int = MAX_HEALTH
    cause: str = ""
    """One of `CAUSES`; "" while alive."""
    by: str = ""
    """Id of the snake that eliminated it, itself included; "" where nobody did."""
    on: int = 0
    """Turn of elimination (the old turn + 1); 0 while alive."""

    @property
    def alive(self) -> bool:
        """Whether the snake still plays."""
        return not self.cause

    @property
    def head(self) -> Point:
        """The square of its head."""
        return self.body[0]

    def copy(self) -> Snake:
        """Return a snake that shares nothing with this one."""
        return Snake(self.id, list(self.body), self.health, self.cause, self.by, self.on)


@dataclass
class Board:
    """One position of one game."""

    width: int
    height: int
    turn: int = 0
    snakes: list[Snake] = field(default_factory=list)
    """Every snake that began the game, the eliminated ones too."""
    food: list[Point] = field(default_factory=list)
    hazards: Counter[Point] = field(default_factory=Counter)
    """How many hazards are stacked on a square; squares off the board are a map's own notes (snail_mode)."""

    def copy(self) -> Board:
        """Return a board that shares nothing with this one."""
        snakes = [snake.copy() for snake in self.snakes]
        return Board(self.width, self.height, self.turn, snakes, list(self.food), Counter(self.hazards))

    def alive(self) -> list[Snake]:
        """Return the snakes that still play."""
        return [snake for snake in self.snakes if snake.alive]

    def holds(self, point: Point) -> bool:
        """Tell whether a square lies on the board."""
        return 0 <= point[0] < self.width and 0 <= point[1] < self.height

    def squares(self) -> list[Point]:
        """Return every square in cell order: the bottom row first, each row from left to right."""
        return [(x, y) for y in range(self.height) for x in range(self.width)]

    def centre(self) -> Point:
        """Return the middle square (of an even side, the lower of the two)."""
        return (self.width - 1) // 2, (self.height - 1) // 2

    def free_squares(self, spare_hazards: bool = False) -> list[Point]:
        """Return where food may fall, in cell order (facts: A.8).

        Not on food, not on the body of a living snake, not beside a living head; eliminated bodies do not count.
        Hazards do not count either, unless `spare_hazards` is asked for.
        """
        taken = set(self.food)
        for snake in self.alive():
            taken.update(snake.body)
            taken.update(neighbours(snake.head))
        if spare_hazards:
            taken.update(point for point, count in self.hazards.items() if count > 0)
        return [point for point in self.squares() if point not in taken]


def neighbours(point: Point) -> list[Point]:
    """Return the four squares beside a square, on the board or not, in the order of `MOVES`."""
    return [(point[0] + dx, point[1] + dy) for dx, dy in STEPS]


def draw(board: Board) -> str:
    """Return the board as text, the top row first.

    A living snake is a letter: capital head, small body; `*` food, `1` to `9` stacked hazards, `.` nothing.

    >>> print(draw(Board(4, 2, snakes=[Snake("a", [(1, 1), (1, 0), (0, 0)])], food=[(3, 0)])))
    .A..
    aa.*
    """
    rows = [["."] * board.width for _ in range(board.height)]
    for (x, y), count in board.hazards.items():
        if board.holds((x, y)) and count > 0:
            rows[y][x] = str(min(count, 9))
    for x, y in board.food:
        rows[y][x] = "*"
    for number, snake in enumerate(board.snakes):
        letter = chr(ord("a") + number % 26)
        for x, y in reversed(snake.body if snake.alive else []):
            if board.holds((x, y)):
                rows[y][x] = letter.upper() if (x, y) == snake.head else letter
    return "\n".join("".join(row) for row in reversed(rows))
