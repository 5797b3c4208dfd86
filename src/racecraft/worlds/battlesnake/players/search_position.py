"""A board as the position of a search: the arrays that `kernels/position.py` plays forward.

Only living snakes take part, in their order. The map is left out: nobody knows what it will do next.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.battlesnake.env.board import STEPS, Board, BoardError, Point, Snake
from racecraft.worlds.battlesnake.env.rulesets import is_over
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.kernels import position as at
from racecraft.worlds.battlesnake.players.safe_moves import is_wrapped
from racecraft.worlds.battlesnake.players.weights import DEFAULT_WEIGHTS, Weights

DEEPEST = 64
"""Turns that a search plays forward at most."""


class Position(NamedTuple):
    """A position and the line of those that are played from it; see `kernels/position.py` for the shapes."""

    ring: Array
    rows: Array
    bits: Array
    cells: Array
    edges: Array
    rules: Array


def position_of(
    board: Board, settings: GameSettings, deepest: int = DEEPEST, weights: Weights = DEFAULT_WEIGHTS
) -> Position:
    """Return a board as ply 0 of a line.

    Raises:
        BoardError: A living snake lies off the board, on another, or across itself.
    """
    num_snakes, area, wrapped = len(board.alive()), board.width * board.height, is_wrapped(settings)
    cells, edges = _ground(board.width, board.height, wrapped)
    position = Position(
        ring=np.zeros((num_snakes, 1 << (area + deepest + 2).bit_length()), np.int16),
        rows=np.zeros((deepest + 1, num_snakes, at.NUM_COLUMNS), np.int32),
        bits=np.zeros((deepest + 1, 2, edges.shape[1]), np.uint64),
        cells=cells.copy(),
        edges=edges,
        rules=np.zeros(at.NUM_RULES, np.int32),
    )
    for (x, y), count in board.hazards.items():
        if board.holds((x, y)):
            position.cells[y * board.width + x, at.HAZARDS] = max(0, count)
    _put_snakes(position, board)
    solo = not is_over(Board(1, 1, snakes=[Snake("", [(0, 0)])]), settings) or num_snakes < 2
    grows = settings.ruleset.endswith("constrictor")
    position.rules[: at.TURN + 1] = (
        board.width, board.height, wrapped, grows, solo, settings.hazard_damage, board.turn
    )  # fmt: skip
    position.rules[at.SQUARES_WEIGHT : at.BURN_WEIGHT + 1] = weights.parts()
    return position


def fill_buffers(position: Position) -> tuple[Array, Array]:
    """Return `pools` and `found` for `kernels/fill.py`."""
    num_snakes, words = position.rows.shape[1], position.bits.shape[2]
    return np.zeros((num_snakes + 1, 3, words), np.uint64), np.zeros((num_snakes, 3), np.int32)


def node_cost(position: Position) -> int:
    """Return how much more there is to do for a position than for a duel on a board of two words, 1 or more."""
    return max(1, position.rows.shape[1] * position.bits.shape[2] // 4)


def board_at(position: Position, d: int, board: Board) -> Board:
    """Return ply d as a board of the snakes that still live; `board` is the one that ply 0 was made of."""
    found = Board(board.width, board.height, board.turn + d, hazards=board.hazards.copy())
    for number, snake in enumerate(board.alive()):
        row = position.rows[d, number]
        if row[at.OUT]:
            continue
        places = (row[at.START] + np.arange(row[at.COUNT])) % position.ring.shape[1]
        body = [(int(cell) % board.width, int(cell) // board.width) for cell in position.ring[number, places]]
        found.snakes.append(Snake(snake.id, body + [body[-1]] * int(row[at.STACK]), int(row[at.HEALTH])))
    food = position.bits[d, at.FOOD]
    found.food = [(x, y) for x, y in board.squares() if _is_set(food, y * board.width + x)]
    return found


@cache
def _ground(width: int, height: int, wrapped: bool) -> tuple[Array, Array]:
    """Return `cells` without hazards and `edges` of a board; whoever wants to write into them copies them."""
    cells, edges = (
        np.full((width * height, 5), -1, np.int16),
        np.zeros((5, max(2, -(-width * height // 64))), np.uint64),
    )
    cells[:, at.HAZARDS] = 0
    for y in range(height):
        for x in range(width):
            cell = y * width + x
            for way, (dx, dy) in enumerate(STEPS):
                to_x, to_y = ((x + dx) % width, (y + dy) % height) if wrapped else (x + dx, y + dy)
                if 0 <= to_x < width and 0 <= to_y < height:
                    cells[cell, way] = to_y * width + to_x
            for edge, is_there in enumerate((True, x == 0, x == width - 1, y == 0, y == height - 1)):
                if is_there:
                    _set(edges[edge], cell)
    return cells, edges


def _put_snakes(position: Position, board: Board) -> None:
    taken: set[Point] = set()
    for number, snake in enumerate(board.alive()):
        squares = list(dict.fromkeys(snake.body))
        stack = len(snake.body) - len(squares)
        is_line = snake.body == squares + squares[-1:] * stack
        if not is_line or not taken.isdisjoint(squares) or not all(board.holds(one) for one in squares):
            raise BoardError("snake {id} lies off the board, on another living snake, or across itself.", id=snake.id)
        taken.update(squares)
        cells = [y * board.width + x for x, y in squares]
        position.ring[number, : len(cells)] = cells
        position.rows[0, number] = 0, len(cells), stack, snake.health, cells[0], 0
        for cell in cells:
            _set(position.bits[0, at.BODIES], cell)
    for x, y in board.food:
        if board.holds((x, y)):
            _set(position.bits[0, at.FOOD], y * board.width + x)


def _set(bits: Array, cell: int) -> None:
    bits[cell >> 6] |= np.uint64(1 << (cell & 63))


def _is_set(bits: Array, cell: int) -> bool:
    return bool(int(bits[cell >> 6]) >> (cell & 63) & 1)
