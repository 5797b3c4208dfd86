"""Checks of lesson 6: one step of the policy gradient by hand."""

from __future__ import annotations

import random
from collections.abc import Sequence
from functools import cache

from racecraft.lessons.checking import Answer, AnswerError, Verdict, compared, passed, predicted, tried
from racecraft.lessons.functions import call_function, is_number
from racecraft.lessons.models.chance import Chance
from racecraft.lessons.models.grid import Drive, drive, make_grid
from racecraft.lessons.models.policy_gradient import (
    climbed,
    drive_row,
    gradient,
    learn_grid,
    probabilities,
    share_pointing_right,
)

EVEN = (0.0, 0.0, 0.0)
FOUR = ((1, 0, 1, 0), (0, 0), (2, 2), (1, 1, 0, 0))
"""The moves of the lesson's four drives."""
STEP = 0.5
HIGH = 11.5
"""A mean total from which on nearly every drive is the best one."""
SIDES = ("left", "straight", "right")


def four_drives() -> list[tuple[int, float]]:
    """Return first move and total of the lesson's four drives."""
    grid = make_grid()
    return [(moves[0], drive(grid, moves).total) for moves in FOUR]


def row_of_four(answer: Answer) -> Verdict:
    """The row of drive 4: total times (1 − π) for straight and times −π for the others."""
    move, total = four_drives()[3]
    right = drive_row(EVEN, move, total)
    given = [answer.number(side) for side in SIDES]
    wrong = {
        "sign": [-right[0], right[1], -right[2]], "only_own": [0, total, 0], "no_total": [one / total for one in right],
    }  # fmt: skip
    return compared(given, right, 0.01, wrong, names=SIDES, total=total, sum=sum(given))


def mean_and_policy(answer: Answer) -> Verdict:
    """The mean over four drives for straight, and π(straight) after a step of 0.5."""
    slope = gradient(EVEN, four_drives(), has_baseline=False)
    pi = probabilities(climbed(EVEN, slope, STEP))
    mean, after = answer.number("mean"), answer.number("pi")
    if abs(mean - 4 * slope[1]) <= 0.02:
        return tried("sum_not_mean", mean=mean)
    if abs(mean - slope[1]) > 0.01:
        return tried("mean_wrong", mean=mean)
    if abs(after - (1 / 3 + STEP * slope[1])) <= 0.01:
        return tried("added_to_pi", after=after)
    if abs(after - pi[1]) > 0.01:
        return tried("pi_wrong", after=after)
    return passed(mean=slope[1], after=pi[1], before=1 / 3)


def points_away(answer: Answer) -> Verdict:
    """A batch whose best drive goes straight first, and whose gradient still lowers straight."""
    batch = batch_of(answer)
    slope = gradient(EVEN, [(one.moves[0], one.total) for one in batch], has_baseline=False)
    best = max(batch, key=lambda one: one.total)
    if slope[1] >= 0:
        return tried("points_right", straight=slope[1])
    if best.moves[0] != 1 or sum(one.moves[0] == 1 for one in batch) != 1 or best.total < 8:
        return tried("no_good_straight", straight=slope[1])
    return passed(straight=slope[1], best=best.total)


def batch_of(answer: Answer) -> Sequence[Drive]:
    """Return the figure's drives: lists of moves.

    Raises:
        AnswerError: They are not four drives that ended.
    """
    given, grid = answer.taken("batch"), make_grid()
    try:
        batch = [drive(grid, [int(move) for move in moves]) for moves in given]
        if len(batch) != 4 or any(not one.ended or set(one.moves) - {0, 1, 2} for one in batch):
            raise ValueError
    except (TypeError, ValueError, IndexError):
        raise AnswerError("The figure does not hold four drives that have ended.") from None
    return batch


@cache
def share_right(count: int) -> float:
    """Return in which share of 1,000 batches of so many drives the step, with baseline, points straight."""
    return share_pointing_right(count, True, 1000, Chance(count))


def drives_needed(answer: Answer) -> Verdict:
    """The smallest number of drives whose update points right nine times in ten: 18 by 40,000 batches."""
    count = round(answer.number("drives"))
    share = 100 * share_right(min(count, 60))
    if abs(count - 18) <= 2:
        return passed(drives=count, share=share)
    return tried("too_few" if count < 18 else "more_than_needed", drives=count, share=share)


@cache
def learned_with(step: float) -> Sequence[Sequence[float]]:
    """Return the mean total of each of 60 updates of 20 drives, for five seeds."""
    return [learn_grid(step, 60, Chance(1000 + seed)) for seed in range(5)]


def updates_needed(step: float) -> int | None:
    """Return after how many updates all five seeds have reached 11.5; None: one never does."""
    needed = [next((at for at, mean in enumerate(row, 1) if mean >= HIGH), None) for row in learned_with(step)]
    return None if None in needed else max(one for one in needed if one is not None)


def too_large(answer: Answer) -> Verdict:
    """A prediction: from which step size on does a seed stay on a worse drive?"""
    given = answer.number("step")
    rows = [(step, sum(row[-1] > HIGH for row in learned_with(step)), min(row[-1] for row in learned_with(step)))
            for step in (0.3, 1.0, 5.0, 20.0)]  # fmt: skip
    return predicted(answer, "reason", "certain_too_soon", rows, predicted=given)


def best_step(answer: Answer) -> Verdict:
    """Which of five step sizes brings all five seeds to 11.5 soonest, and which leaves seeds on a worse drive?"""
    fastest, stuck = answer.choice("fastest"), answer.choice("stuck")
    updates = updates_needed(float(fastest))
    if updates is None:
        return tried("never", step=fastest)
    if fastest != "1":
        return tried("slower", step=fastest, updates=updates)
    if stuck != "20":
        early, late = (sum(row[at] for row in learned_with(float(stuck))) / 5 for at in (29, 59))
        return tried("still_climbing", step=stuck, early=early, late=late)
    return passed(updates=updates, slow=updates_needed(0.3))


def own_weights(answer: Answer) -> Verdict:
    """The pupil's `weights(returns)` against returns less their mean, on 100 random lists."""
    rng = random.Random()
    lists = [[round(rng.uniform(-5, 15), 3) for _ in range(rng.randint(2, 12))] for _ in range(100)]
    found = call_function(answer.code("code"), "weights", [[one] for one in lists])
    for returns, given in zip(lists, found, strict=True):
        if not isinstance(given, list) or len(given) != len(returns) or not all(map(is_number, given)):
            return tried("no_list", given=str(given)[:60])
        mean = sum(returns) / len(returns)
        if any(abs(one - (value - mean)) > 1e-9 for one, value in zip(given, returns, strict=True)):
            unchanged = all(abs(one - value) < 1e-9 for one, value in zip(given, returns, strict=True))
            return tried("unchanged" if unchanged else "sum_not_zero" if abs(sum(given)) > 1e-9 else "other_scale",
                         returns=str(returns[:3])[:-1] + ", …]", sum=sum(given))  # fmt: skip
    return passed()
