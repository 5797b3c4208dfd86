"""Checks of lesson 2: totals, values and a policy in the grid world."""

from __future__ import annotations

from racecraft.lessons.checking import Answer, Verdict, compared, passed, tried
from racecraft.lessons.exercises.reading_figures import drive_of, grid_from
from racecraft.lessons.models.grid import (
    OFF,
    best_drive,
    drive,
    make_grid,
    new_q,
    optimal_values,
    update,
    with_pay,
)

CLOSE = 1e-9
GAMMA, ALPHA = 0.9, 0.5


def total_is(answer: Answer) -> Verdict:
    """An episode that ended, began straight on, and has exactly the total that is asked for."""
    grid, driven = drive_of(answer, "drive")
    total = float(answer.arguments["total"])
    if grid != make_grid():
        return tried("other_grid")
    if not driven.ended:
        return tried("not_ended", total=driven.total)
    if abs(driven.total - total) > CLOSE:
        return tried("too_much" if driven.total > total else "too_little", total=driven.total)
    if driven.moves[0] != 1:
        return tried("begins_aside", total=driven.total)
    return passed(total=driven.total, moves=len(driven.moves))


def best_total(answer: Answer) -> Verdict:
    """The drive that no other beats, on the grid as it is."""
    grid, driven = drive_of(answer, "drive")
    best = best_drive(grid, 1.0).total
    if grid != make_grid():
        return tried("other_grid")
    if not driven.ended:
        return tried("not_ended", total=driven.total)
    if driven.total < best - CLOSE:
        return tried("left_road" if driven.ended == OFF else "stayed", total=driven.total, best=best)
    return passed(total=driven.total)


def last_values(answer: Answer) -> Verdict:
    """The values of the last two squares before the goal, against value iteration on the learner's grid."""
    values = optimal_values(make_grid(), GAMMA)[2]
    last, before = answer.number("last"), answer.number("before")
    wrong = {"only_reward": (values[5], 2.0), "no_discount": (values[5], 4.0)}
    otherwise = "before_wrong" if abs(last - values[5]) <= 0.05 else "last_wrong"
    return compared((last, before), (values[5], values[4]), 0.05, wrong, otherwise, names=("last", "before"))


def after_three(answer: Answer) -> Verdict:
    """Two values after three straight drives from zero, against the three updates."""
    grid = make_grid()
    q = new_q(grid)
    for _ in range(3):
        square = grid.start
        while not grid.ends(square):
            update(q, grid, square, 1, ALPHA, GAMMA)
            square = grid.after(square, 1)
    last, start = answer.number("last"), answer.number("start")
    if abs(last - q[2][5][1]) > 0.005:
        return tried("whole_step" if abs(last - 2.0) <= 0.005 else "last_wrong", last=last)
    if abs(start - q[2][0][1]) > 0.005:
        return tried("same_everywhere" if abs(start - last) <= 0.005 else "start_wrong", start=start)
    return passed(last=q[2][5][1], start=q[2][0][1])


def one_square(answer: Answer) -> Verdict:
    """One square changed, by no more than it takes for the best way to leave the centre."""
    raw = answer.taken("grid")
    grid = grid_from(raw)
    usual = make_grid()
    changed = [(r, c) for r in range(usual.rows) for c in range(usual.columns)
               if grid.columns == usual.columns and abs(grid.pay[r][c] - usual.pay[r][c]) > CLOSE]  # fmt: skip
    if grid.columns != usual.columns or grid.moves != usual.moves or not changed:
        return tried("nothing_changed")
    if len(changed) > 1:
        return tried("several", count=len(changed))
    best = best_drive(grid, GAMMA)
    if all(row == 2 for row, _ in best.squares):
        return tried("still_straight", total=best.total, straight=drive(grid, [1] * 6).total)
    row, column = changed[0]
    back = 0.1 if grid.pay[row][column] < usual.pay[row][column] else -0.1
    smaller = with_pay(grid, (row, column), grid.pay[row][column] + back)
    if not all(row == 2 for row, _ in best_drive(smaller, GAMMA).squares):
        return tried("more_than_needed", pay=grid.pay[row][column])
    return passed(total=best.total, straight=drive(grid, [1] * 6).total)
