"""Checks of lessons 3 to 5: what a reward teaches, exploring, and how far ahead a car looks."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

from racecraft.lessons.checking import Answer, Verdict, passed, predicted, tried
from racecraft.lessons.models import fork
from racecraft.lessons.models.chance import Chance
from racecraft.lessons.models.grid import GOAL, Learning, chance_to_reach, greedy_drive, learn, make_grid

SEEDS, FIRST_SEED = 20, 1000
LATE_TOTAL = 11.2
LENGTHS = (10, 14, 17, 20, 25)


def reached(columns: int, pays: str, learning: Learning, seeds: int = SEEDS, goal: float = 2.0) -> int:
    """Return in how many trainings the greedy car reaches the goal afterwards."""
    grid, found = make_grid(columns, pays, goal), 0
    for seed in range(seeds):
        chance = Chance(FIRST_SEED + seed)
        q, _ = learn(grid, learning, chance)
        found += greedy_drive(grid, q, chance).ended == GOAL
    return found


@cache
def goal_alone() -> Sequence[tuple[int, int, int]]:
    """Return by length how many of 10 trainings reach a goal that alone pays 2, and one that pays 20."""
    learning = Learning(epsilon=0.1)
    return [
        (columns, reached(columns, "goal", learning, 10), reached(columns, "goal", learning, 10, 20.0))
        for columns in LENGTHS
    ]


def goal_fails(answer: Answer) -> Verdict:
    """A prediction: at which length does pay at the goal alone stop working?"""
    columns = answer.number("columns")
    rows = goal_alone()
    fails = next((length for length, found, _ in rows if found < 5), LENGTHS[-1])
    table = (("columns", "of 10 reach the goal", "of 10 with ten times the prize"), rows)
    return predicted(answer, "reason", "never_paid", table, predicted=columns, fails=float(fails))


def first_reward(answer: Answer) -> Verdict:
    """How many drives until the first reward, on 12 moves."""
    given, right = answer.number("drives"), 1.0 / chance_to_reach(12)
    if abs(given - right) <= 1.5:
        return passed(drives=right, chance=100 * chance_to_reach(12))
    if abs(given - 1 / chance_to_reach(13)) <= 1.5:
        return tried("columns_not_moves")
    return tried("too_few" if given < right else "too_many", drives=given)


def better_epsilon(answer: Answer) -> Verdict:
    """A prediction: ε 0 or ε 0.3?"""
    answer.choice("better")
    rows = epsilon_rows()
    return predicted(answer, "reason", "never_tries", (("ε", "of 20 find 12.0", "mean total of the last 50"), rows))


@cache
def epsilon_rows() -> Sequence[Sequence[Any]]:
    """Return what ε 0 and 0.3 reach: ε, how many of 20 seeds find the best drive, mean total of the last 50 drives."""
    rows = []
    for epsilon in (0.0, 0.3):
        found, late = late_totals(Learning(epsilon=epsilon))
        rows.append((epsilon, found, late))
    return rows


def late_totals(learning: Learning) -> tuple[int, float]:
    """Return how many of 20 seeds find the best drive, and the mean total of the last 50 drives."""
    grid, found, late = make_grid(), 0, 0.0
    for seed in range(SEEDS):
        chance = Chance(FIRST_SEED + seed)
        q, totals = learn(grid, learning, chance)
        found += abs(greedy_drive(grid, q, chance).total - 12.0) < 1e-9
        late += sum(totals[-50:]) / 50 / SEEDS
    return found, late


def schedule(answer: Answer) -> Verdict:
    """ε of the first and of the last drive, so that the last 50 drives average LATE_TOTAL or more."""
    first, last = answer.number("first"), answer.number("last")
    found, late = late_totals(Learning(epsilon=first, epsilon_last=last))
    if late >= LATE_TOTAL:
        return passed(mean=late, found=found, seeds=SEEDS)
    if last > 0.05:
        return tried("still_exploring", mean=late, found=found, seeds=SEEDS, last=last)
    return tried("never_explored", mean=late, found=found, seeds=SEEDS)


def where_it_turns(answer: Answer) -> Verdict:
    """The γ at which the greedy action changes, within 0.01."""
    gamma, right = answer.number("gamma"), fork.turn()
    if abs(gamma - right) <= 0.01:
        return passed(gamma=right)
    left, far = fork.worth(gamma, *fork.LEFT), fork.worth(gamma, *fork.RIGHT)
    return tried("still_left" if gamma < right else "already_right", gamma=gamma, left=left, right=far)


def lap_end(answer: Answer) -> Verdict:
    """What weight the end of a lap of 20 s still has at γ 0.99."""
    weight, right = answer.number("weight"), 0.99**300
    if abs(weight - right) <= 0.005:
        return passed(weight=right, near=0.9**300, far=0.999**300)
    if abs(weight - 0.99**20) <= 0.02:
        return tried("seconds_not_steps")
    return tried("too_small" if weight < right else "too_large", weight=weight)


CHECKS = {
    "goal_fails": goal_fails,
    "first_reward": first_reward,
    "better_epsilon": better_epsilon,
    "schedule": schedule,
    "where_it_turns": where_it_turns,
    "lap_end": lap_end,
}
