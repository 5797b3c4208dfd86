"""Checks of lessons 3 to 5 and 9 on the grid: what a reward teaches, exploring, how far ahead a car looks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from statistics import median
from typing import Any

from racecraft.lessons.checking import Answer, Verdict, compared, passed, predicted, tried
from racecraft.lessons.exercises.reading_figures import grid_paid_by
from racecraft.lessons.models import fork
from racecraft.lessons.models.chance import Chance
from racecraft.lessons.models.grid import (
    GOAL,
    Grid,
    Learning,
    best_drive,
    chance_to_reach,
    greedy_drive,
    learn,
    learn_drive,
    make_grid,
    optimal_values,
)

SEEDS, FIRST_SEED = 20, 1000
LATE_TOTAL = 11.2
LENGTHS = (10, 14, 17, 20, 25)
ENOUGH, LONG_ROAD = 16, 19
CURVES = {
    "a": Learning(epsilon=0.6, drives=600), "b": Learning(epsilon=0.3, drives=600),
    "c": Learning(epsilon=0.6, epsilon_last=0.0, drives=600),
}  # fmt: skip
"""What rc_converged.js lets 20 cars learn by; the third has not converged where its curve breaks off."""
SHOWN, WINDOW, LEVEL = 400, 50, 0.4
"""Drives that a curve shows, and drives whose mean has converged that stays within so much of the last one."""
RATE_A, RATE_B, SEED_A, SEED_B = 0.5, 0.8, 4000, 5060
SURE = 0.05
"""Share of luck below which a difference counts."""


def reached(columns: int, pays: str, learning: Learning, seeds: int = SEEDS, goal: float = 2.0) -> int:
    """Return in how many trainings the greedy car reaches the goal afterwards."""
    return reached_on(make_grid(columns, pays, goal), learning, seeds)


def reached_on(grid: Grid, learning: Learning, seeds: int) -> int:
    """Return in how many trainings on this road the greedy car reaches the goal afterwards."""
    found = 0
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
    return predicted(answer, "reason", "never_paid", rows, predicted=columns, fails=float(fails))


def two_numbers(answer: Answer) -> Verdict:
    """A pay of at most two numbers by which 18 of 20 cars learn the way to the end of 25 columns in 300 drives."""
    grid = grid_paid_by(answer, "code", 25)
    if grid is None:
        return tried("no_number")
    numbers = len({one for row in grid.pay for one in row})
    if numbers > 2:
        return tried("many", count=numbers)
    found = reached_on(grid, Learning(epsilon=0.1), SEEDS)
    return passed(found=found) if found >= 18 else tried("few", found=found, seeds=SEEDS)


def long_road(answer: Answer) -> Verdict:
    """As few drives as it takes for 16 of 20 cars to learn a road of 19 columns whose goal alone pays."""
    drives = round(answer.number("drives"))
    learning = Learning(epsilon=answer.number("epsilon"), gamma=answer.number("gamma"), drives=drives)
    fewer = reached(LONG_ROAD, "goal", replace(learning, drives=round(0.8 * drives)))
    if fewer >= ENOUGH:
        return tried("more_than_needed", found=fewer, drives=drives)
    found = reached(LONG_ROAD, "goal", learning)
    if found < ENOUGH:
        return tried("few" if drives > Learning.drives else "not_longer", found=found, drives=drives)
    return passed(found=found, fewer=fewer, drives=drives)


@cache
def mean_totals(curve: str) -> Sequence[float]:
    """Return the mean total of 20 cars over the WINDOW drives from each drive on."""
    trained = [learn(make_grid(), CURVES[curve], Chance(FIRST_SEED + seed))[1] for seed in range(SEEDS)]
    means = [sum(row) / SEEDS for row in zip(*trained, strict=True)]
    return [sum(means[at : at + WINDOW]) / WINDOW for at in range(len(means) - WINDOW + 1)]


@cache
def converged_at(curve: str) -> int:
    """Return the drive from which on every mean stays within LEVEL of the last one."""
    totals = mean_totals(curve)
    return next(at for at in range(len(totals)) if max(abs(one - totals[-1]) for one in totals[at:]) < LEVEL)


def converged(answer: Answer) -> Verdict:
    """From which drive on two of three curves have converged; 0 says that a curve has not."""
    marks = {curve: round(answer.number(curve)) for curve in CURVES}
    rows = [
        (curve.upper(), *(mean_totals(curve)[at] for at in (min(mark, SHOWN), SHOWN - WINDOW, -1)))
        for curve, mark in marks.items()
    ]
    case = next((case for curve, mark in marks.items() if (case := _misjudged(curve, mark))), "")
    values = {f"of_{curve}": converged_at(curve) for curve in CURVES}
    return Verdict("tried" if case else "passed", case, values, rows)


def _misjudged(curve: str, mark: int) -> str:
    right = converged_at(curve)
    if right > SHOWN:
        return "still_climbs" if mark else ""
    if not mark:
        return "flat_below"
    return "too_early" if mark < right - 20 else "too_late" if mark > right + 150 else ""


@cache
def late_means(rate: float, first: int) -> Sequence[float]:
    """Return the mean total of the last 50 of 200 drives, for ten seeds."""
    learning = Learning(alpha=rate, epsilon=0.2, drives=200)
    return [sum(learn(make_grid(), learning, Chance(first + seed))[1][-50:]) / 50 for seed in range(10)]


@cache
def luck(seeds: int) -> float:
    """Return the share of ways to part the seeds in which the second group leads as clearly, as `compare` tests it."""
    from racecraft.evaluation.seed_statistics import compare_groups

    return compare_groups(late_means(RATE_B, SEED_B)[:seeds], late_means(RATE_A, SEED_A)[:seeds], False).luck


def better_or_luck(answer: Answer) -> Verdict:
    """A prediction: is a step of 0.8 better than one of 0.5, or was it luck? As many seeds are run as are asked for."""
    seeds = round(answer.number("seeds")) if answer.has("seeds") else 3
    groups = [(rate, late_means(rate, first)[:seeds]) for rate, first in ((RATE_A, SEED_A), (RATE_B, SEED_B))]
    rows = [(rate, seeds, sum(row) / seeds, min(row), max(row)) for rate, row in groups]
    values = {"seeds": seeds, "luck": 100 * luck(seeds)}
    if answer.has("reason") and seeds < 10:
        return Verdict("run", "few_seeds", values, rows)
    return predicted(answer, "reason", "shown" if luck(seeds) < SURE else "open", rows, **values)


def finishes(answer: Answer) -> Verdict:
    """A pay by which the best policy of a car that may turn on the spot still ends at the goal."""
    grid = grid_paid_by(answer, "code", 7, "free")
    if grid is None:
        return tried("no_number")
    best, worth = best_drive(grid, 0.9), optimal_values(grid, 0.9)[2][0]
    if best.ended == GOAL:
        return passed(moves=len(best.moves), worth=worth)
    return tried("elsewhere" if best.ended else "for_ever", worth=worth)


def first_reward(answer: Answer) -> Verdict:
    """How many drives until the first reward, on 12 moves."""
    given, right = answer.number("drives"), 1.0 / chance_to_reach(12)
    wrong, otherwise = {"columns_not_moves": 1 / chance_to_reach(13)}, "too_few" if given < right else "too_many"
    return compared(given, right, 1.5, wrong, otherwise, drives=given, chance=100 * chance_to_reach(12))


def better_epsilon(answer: Answer) -> Verdict:
    """A prediction: ε 0 or ε 0.3?"""
    return predicted(answer, "reason", "never_tries", epsilon_rows())


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


def found_again(answer: Answer) -> Verdict:
    """A prediction: which ε finds the new best drive soonest, once the pay has moved to the row above?"""
    return predicted(answer, "reason", "old_values", again_rows())


@cache
def again_rows() -> Sequence[Sequence[Any]]:
    """Return by ε how many of 20 cars find the new best drive within 500 drives, and the median of their drives."""
    rows: list[Sequence[Any]] = []
    for epsilon in (0.0, 0.05, 0.3):
        needed = [one for seed in range(SEEDS) if (one := drives_until_found(epsilon, seed)) is not None]
        rows.append((epsilon, len(needed), median(needed) if needed else "–"))
    return rows


def drives_until_found(epsilon: float, seed: int) -> int | None:
    """Return how many drives a car that knows the middle row needs after its pay has moved; None: more than 500."""
    road, chance = make_grid(), Chance(FIRST_SEED + seed)
    q, _ = learn(road, Learning(), chance)
    pay = (road.pay[0], road.pay[2], road.pay[1], *road.pay[3:])
    moved = replace(road, pay=pay, goal=(1, 6))
    best = best_drive(moved, 0.9).total
    for number in range(1, 501):
        learn_drive(moved, q, 0.5, 0.9, epsilon, chance)
        if abs(greedy_drive(moved, q, chance).total - best) < 1e-9:
            return number
    return None


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
