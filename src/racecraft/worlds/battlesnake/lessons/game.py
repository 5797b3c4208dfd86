"""The lessons' small game: one snake moved by hand, one that walks in a circle, food that one can foresee.

The rules are the referee's; `modules/game.js` plays the same game in the browser.
"""

from __future__ import annotations

from collections.abc import Sequence

from racecraft.worlds.battlesnake.env.board import MOVES, STEPS, Board, Snake
from racecraft.worlds.battlesnake.env.reference import apply_rules
from racecraft.worlds.battlesnake.env.rulesets import find_ruleset
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.stages import GameContext

SIDE, MAX_TURNS = 7, 100
YOU, OTHER = "you", "other"
START = [(1, 1), (1, 1), (1, 1)]
START_HEALTH = 20
CIRCLE = [(3, 3), (3, 4), (3, 5), (4, 5), (5, 5), (5, 4), (5, 3), (4, 3)]
"""Squares that the other snake's head visits, one a turn and over again; its four segments lie on them."""
LENGTH_OF_OTHER = 4
FIRST_FOOD, FOOD_STEP = 16, 17
"""Cell of the first food, and how many cells further each next one falls where there is room."""
GAME = GameContext(GameSettings(width=SIDE, height=SIDE, players=2, ruleset="solo"))


def first_board() -> Board:
    """Return the position at turn 0."""
    other = Snake(OTHER, [CIRCLE[-k % len(CIRCLE)] for k in range(LENGTH_OF_OTHER)])
    board = Board(SIDE, SIDE, snakes=[Snake(YOU, list(START), START_HEALTH), other])
    _drop_food(board, FIRST_FOOD)
    return board


def play(moves: Sequence[str]) -> Board:
    """Return the position after moves; those behind the snake's end, or behind turn 100, change nothing.

    Args:
        moves: Names of `MOVES`.
    """
    board, rules = first_board(), find_ruleset("solo")
    for move in moves[:MAX_TURNS]:
        if not board.snakes[0].alive:
            break
        before = board.food[0]
        apply_rules(rules, board, {YOU: move, OTHER: _step_of_circle(board.turn)}, GAME)
        board.turn += 1
        if not board.food:
            _drop_food(board, before[1] * SIDE + before[0] + FOOD_STEP)
    return board


def _step_of_circle(turn: int) -> str:
    (x, y), (to_x, to_y) = CIRCLE[turn % len(CIRCLE)], CIRCLE[(turn + 1) % len(CIRCLE)]
    return MOVES[STEPS.index((to_x - x, to_y - y))]


def _drop_food(board: Board, cell: int) -> None:
    """Lay food on a cell, or on the next one that is neither a living body's nor the circle's."""
    taken = {*CIRCLE, *(point for snake in board.alive() for point in snake.body)}
    for k in range(SIDE * SIDE):
        y, x = divmod((cell + k) % (SIDE * SIDE), SIDE)
        if (x, y) not in taken:
            board.food = [(x, y)]
            return
