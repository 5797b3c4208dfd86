"""What figures give to checks: drives and grids, as they come from a page. Nothing in them is trusted."""

from __future__ import annotations

import math
from typing import Any

from racecraft.lessons.checking import Answer, AnswerError
from racecraft.lessons.functions import call_for_numbers
from racecraft.lessons.models.grid import MAX_MOVES, Drive, Grid, drive, make_grid

MAX_COLUMNS, MAX_PAY = 60, 100.0


def drive_of(answer: Answer, name: str) -> tuple[Grid, Drive]:
    """Return the grid of a figure and the drive in it: {"grid": …, "moves": [0, 1, 2, …]}.

    Raises:
        AnswerError: It is no drive.
    """
    raw = answer.taken(name)
    grid = grid_from(raw.get("grid") if isinstance(raw, dict) else None)
    moves = raw.get("moves")
    if not isinstance(moves, list) or not moves or len(moves) > MAX_MOVES or not all(one in (0, 1, 2) for one in moves):
        raise AnswerError("There is no drive in the figure yet; drive with its buttons or the arrow keys, then check.")
    return grid, drive(grid, [int(one) for one in moves])


def grid_paid_by(answer: Answer, name: str, columns: int, moves: str = "ahead") -> Grid | None:
    """Return a road on which a pupil's `pay(row, column)` says what each square pays; None: it gives no numbers.

    Raises:
        AnswerError: The code does not run.
    """
    grid = make_grid(columns, moves=moves)
    squares = [[row, column] for row in range(grid.rows) for column in range(columns)]
    paid = call_for_numbers(answer.code(name), "pay", squares)
    if paid is None:
        return None
    rows = tuple(tuple(map(float, paid[at : at + columns])) for at in range(0, len(paid), columns))
    return Grid(rows, grid.start, grid.goal, moves)


def grid_from(raw: Any) -> Grid:
    """Return a grid from what a figure gives: columns, pays, goal, moves, changed (row, column, pay).

    Raises:
        AnswerError: It is no grid.
    """
    try:
        columns = int(raw["columns"])
        if not 3 <= columns <= MAX_COLUMNS:
            raise ValueError
        grid = make_grid(columns, str(raw.get("pays", "centre")), float(raw.get("goal", 2.0)), str(raw["moves"]))
        pay = [list(row) for row in grid.pay]
        for row, column, value in raw.get("changed", []):
            if not (0 <= row < grid.rows and 0 <= column < columns and abs(value) <= MAX_PAY and math.isfinite(value)):
                raise ValueError
            pay[row][column] = float(value)
    except (TypeError, KeyError, ValueError, IndexError):
        raise AnswerError("The figure's grid cannot be read; load the page again.") from None
    return Grid(tuple(map(tuple, pay)), grid.start, grid.goal, grid.moves)
