"""The grid world of lessons 2 to 6, exactly as modules/grid.js has it.

    rows × columns squares; a move pays what stands on the square that is entered
    rows at both edges and the last column end a drive
    ahead      left, straight and right each go one column on: a car cannot turn round
    free       left and right change the row alone, so that a drive may go on for ever

Rows are counted from the top, columns from the left, both from 0; the car faces right, so that left is up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

from racecraft.lessons.models.chance import Chance

MOVES = ("left", "straight", "right")
TURN = (-1, 0, 1)
GOAL, BESIDE, OFF = "goal", "beside", "off"
MAX_MOVES = 200
"""A free drive is cut here."""
Square = tuple[int, int]
Values = list[list[float]]
Q = list[list[list[float]]]
"""Value by row, column and move."""


@dataclass(frozen=True)
class Grid:
    """What every square pays, and how a car moves."""

    pay: tuple[tuple[float, ...], ...]
    start: Square = (2, 0)
    goal: Square = (2, 6)
    moves: str = "ahead"

    @property
    def rows(self) -> int:
        """How many rows there are."""
        return len(self.pay)

    @property
    def columns(self) -> int:
        """How many columns there are."""
        return len(self.pay[0])

    def ends(self, square: Square) -> str:
        """Return how a drive ends on a square; "" where it goes on."""
        row, column = square
        if row in (0, self.rows - 1):
            return OFF
        if square == self.goal:
            return GOAL
        return BESIDE if column == self.columns - 1 else ""

    def after(self, square: Square, move: int) -> Square:
        """Return the square that a move leads to."""
        row, column = square
        ahead = 0 if self.moves == "free" and move != 1 else 1
        return row + TURN[move], column + ahead

    def squares(self) -> Iterator[Square]:
        """Yield every square on which a car decides."""
        for square in product(range(self.rows), range(self.columns)):
            if not self.ends(square):
                yield square


def make_grid(columns: int = 7, pays: str = "centre", goal: float = 2.0, moves: str = "ahead") -> Grid:
    """Return a road of 5 rows.

    Args:
        columns: 3 to 60.
        pays: "centre": 2.0 on the middle row, 0.1 beside it. "goal": `goal` on the last square of the middle row alone.
        goal: What the goal pays where nothing else does.
        moves: "ahead" or "free".
    """
    by_row = (0.0, 0.1, 2.0, 0.1, 0.0) if pays == "centre" else (0.0,) * 5
    pay = [[one] * columns for one in by_row]
    if pays != "centre":
        pay[2][-1] = goal
    return Grid(tuple(map(tuple, pay)), (2, 0), (2, columns - 1), moves)


def with_pay(grid: Grid, square: Square, pay: float) -> Grid:
    """Return a grid in which one square pays something else."""
    rows = [list(row) for row in grid.pay]
    rows[square[0]][square[1]] = pay
    return replace(grid, pay=tuple(map(tuple, rows)))


@dataclass(frozen=True)
class Drive:
    """One episode."""

    squares: tuple[Square, ...]
    """From the start on."""
    moves: tuple[int, ...]
    rewards: tuple[float, ...]
    ended: str
    """GOAL, BESIDE, OFF, or "" where it still goes on."""

    @property
    def total(self) -> float:
        """Its rewards added up."""
        return sum(self.rewards)


def drive(grid: Grid, moves: Sequence[int]) -> Drive:
    """Drive these moves, as far as the episode goes."""
    left = iter(moves)
    return drive_by(grid, lambda _: next(left, None))


def drive_by(grid: Grid, decide: Callable[[Square], int | None]) -> Drive:
    """Drive the moves that are decided square by square, until the episode ends, is cut, or there is none."""
    square, squares, ended = grid.start, [grid.start], ""
    moves: list[int] = []
    rewards: list[float] = []
    while not ended and len(moves) < MAX_MOVES and (move := decide(square)) is not None:
        square = grid.after(square, move)
        moves.append(move)
        squares.append(square)
        rewards.append(grid.pay[square[0]][square[1]])
        ended = grid.ends(square)
    return Drive(tuple(squares), tuple(moves), tuple(rewards), ended)


def every_drive(grid: Grid) -> Iterator[Drive]:
    """Yield all different drives of a short road on which cars go ahead."""
    waiting: list[tuple[int, ...]] = [()]
    while waiting:
        moves = waiting.pop()
        found = drive(grid, moves)
        if found.ended:
            yield found
        else:
            waiting += [(*moves, move) for move in (2, 1, 0)]


def optimal_values(grid: Grid, gamma: float) -> Values:
    """Return every square's value under the best policy: rewards still to come, discounted. Squares that end: 0."""
    return _swept(grid, gamma, max)


def random_values(grid: Grid, gamma: float) -> Values:
    """Return every square's value where each move is equally likely."""
    return _swept(grid, gamma, lambda three: (three[0] + three[1] + three[2]) / 3)


def action_values(grid: Grid, values: Values, square: Square, gamma: float) -> list[float]:
    """Return what each move is worth: its reward and the discounted value of the square behind it."""
    found = []
    for move in range(3):
        row, column = grid.after(square, move)
        found.append(grid.pay[row][column] + gamma * values[row][column])
    return found


def best_drive(grid: Grid, gamma: float) -> Drive:
    """Return the drive of the best policy; of equal moves straight, then left."""
    values = optimal_values(grid, gamma)

    def decide(square: Square) -> int:
        worth = action_values(grid, values, square, gamma)
        best = max(worth)
        return next(one for one in (1, 0, 2) if worth[one] >= best - 1e-9)

    return drive_by(grid, decide)


def _swept(grid: Grid, gamma: float, best: Callable[[Sequence[float]], float]) -> Values:
    values = [[0.0] * grid.columns for _ in range(grid.rows)]
    for _ in range(10_000):
        change = 0.0
        for row, column in reversed(list(grid.squares())):
            value = best(action_values(grid, values, (row, column), gamma))
            change = max(change, abs(value - values[row][column]))
            values[row][column] = value
        if change < 1e-10:
            break
    return values


@dataclass(frozen=True, kw_only=True)
class Learning:
    """How Q-learning learns."""

    alpha: float = 0.5
    gamma: float = 0.9
    epsilon: float = 0.3
    """Share of moves drawn blindly, in the first drive."""
    epsilon_last: float | None = None
    """In the last drive, in between on a line; None: as in the first."""
    drives: int = 300


def new_q(grid: Grid) -> Q:
    """Return values of 0 for every square and move."""
    return [[[0.0] * 3 for _ in range(grid.columns)] for _ in range(grid.rows)]


def update(q: Q, grid: Grid, square: Square, move: int, alpha: float, gamma: float) -> None:
    """Improve one value by one move.

    `Q(s,a) += alpha · (r + gamma · max Q(s′,·) − Q(s,a))`
    """
    row, column = grid.after(square, move)
    reward = grid.pay[row][column]
    ahead = 0.0 if grid.ends((row, column)) else max(q[row][column])
    own = q[square[0]][square[1]]
    own[move] += alpha * (reward + gamma * ahead - own[move])


def choose(values: Sequence[float], epsilon: float, chance: Chance) -> int:
    """Return a move: blind with probability epsilon, otherwise the best, drawn among equals."""
    if epsilon > 0 and chance.share() < epsilon:
        return chance.below(3)
    best = max(values)
    among = [move for move in range(3) if values[move] == best]
    return among[chance.below(len(among))] if len(among) > 1 else among[0]


def learn(grid: Grid, learning: Learning, chance: Chance, q: Q | None = None) -> tuple[Q, list[float]]:
    """Drive and learn; return the values and each drive's total."""
    q = new_q(grid) if q is None else q
    totals = []
    for number in range(learning.drives):
        share = number / max(1, learning.drives - 1)
        last = learning.epsilon if learning.epsilon_last is None else learning.epsilon_last
        epsilon = learning.epsilon + (last - learning.epsilon) * share
        totals.append(learn_drive(grid, q, learning.alpha, learning.gamma, epsilon, chance).total)
    return q, totals


def learn_drive(grid: Grid, q: Q, alpha: float, gamma: float, epsilon: float, chance: Chance) -> Drive:
    """Drive one episode and learn from each of its moves."""

    def decide(square: Square) -> int:
        move = choose(q[square[0]][square[1]], epsilon, chance)
        update(q, grid, square, move, alpha, gamma)
        return move

    return drive_by(grid, decide)


def greedy_drive(grid: Grid, q: Q, chance: Chance) -> Drive:
    """Return the drive that always does what is known to be best; of equals one is drawn."""
    return drive_by(grid, lambda square: choose(q[square[0]][square[1]], 0.0, chance))


def chance_to_reach(moves: int) -> float:
    """Return how likely a random car reaches the goal of a road of so many moves.

    >>> [round(100 * chance_to_reach(n), 2) for n in (6, 12, 24, 39)]
    [13.58, 3.69, 0.27, 0.01]
    """
    root = 2**0.5
    return 0.5 * (((1 + root) / 3) ** moves + ((1 - root) / 3) ** moves)
