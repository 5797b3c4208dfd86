"""One step of the policy gradient on the first move of the grid world, exactly as modules/gradient.js has it.

Three actions (left, straight, right) have preferences θ; `π(a) = exp θ_a / Σ exp θ`. A batch is a list of drives, each
its first move and its total.
"""

from __future__ import annotations

import math
from bisect import bisect
from collections.abc import Mapping, Sequence
from functools import cache

from racecraft.lessons.models.chance import Chance
from racecraft.lessons.models.grid import Drive, Grid, Square, drive_by, every_drive, make_grid

Batch = Sequence[tuple[int, float]]


def probabilities(theta: Sequence[float]) -> list[float]:
    """Return π of preferences."""
    top = max(theta)
    raised = [math.exp(one - top) for one in theta]
    return [one / sum(raised) for one in raised]


def weights(totals: Sequence[float], has_baseline: bool) -> list[float]:
    """Return what each drive counts: its total, less the mean where there is a baseline."""
    mean = sum(totals) / len(totals) if has_baseline else 0.0
    return [one - mean for one in totals]


def drive_row(theta: Sequence[float], move: int, weight: float) -> list[float]:
    """Return what a drive adds: weight times ∂ log π(move) / ∂θ, which is 1 − π for its move and −π for the others."""
    pi = probabilities(theta)
    return [weight * ((1.0 if action == move else 0.0) - pi[action]) for action in range(3)]


def gradient(theta: Sequence[float], batch: Batch, has_baseline: bool) -> list[float]:
    """Return the mean of the drives' rows."""
    counted = weights([total for _, total in batch], has_baseline)
    rows = [drive_row(theta, move, weight) for (move, _), weight in zip(batch, counted, strict=True)]
    return [sum(row[action] for row in rows) / len(rows) for action in range(3)]


def climbed(theta: Sequence[float], slope: Sequence[float], step: float) -> list[float]:
    """Return preferences after a step uphill."""
    return [one + step * way for one, way in zip(theta, slope, strict=True)]


def entropy(pi: Sequence[float]) -> float:
    """Return how undecided a policy is, nats."""
    return -sum(one * math.log(one) for one in pi if one > 0)


@cache
def random_drives() -> tuple[tuple[float, ...], tuple[tuple[int, float], ...]]:
    """Return the random car's drives on the usual road: cumulated probabilities, and each first move and total."""
    share, shares, drives = 0.0, [], []
    for one in every_drive(make_grid()):
        share += 3.0 ** -len(one.moves)
        shares.append(share)
        drives.append((one.moves[0], one.total))
    return tuple(shares), tuple(drives)


def random_batch(count: int, chance: Chance) -> list[tuple[int, float]]:
    """Return so many drives of the random car."""
    shares, drives = random_drives()
    return [drives[min(bisect(shares, chance.share()), len(drives) - 1)] for _ in range(count)]


def share_pointing_right(count: int, has_baseline: bool, batches: int, chance: Chance) -> float:
    """Return in how many of so many batches of `count` drives the step raises straight most."""
    theta, right = (0.0, 0.0, 0.0), 0
    for _ in range(batches):
        slope = gradient(theta, random_batch(count, chance), has_baseline)
        right += slope[1] > max(slope[0], slope[2])
    return right / batches


def learn_grid(step: float, updates: int, chance: Chance, drives: int = 20) -> list[float]:
    """Let a policy with preferences for every square learn the usual road; return the mean total of each update.

    Args:
        step: Of each update, along the gradient with the batch's mean as baseline.
        updates: How many.
        chance: Draws the moves.
        drives: Of each update.
    """
    grid, means = make_grid(), []
    theta = {square: [0.0, 0.0, 0.0] for square in grid.squares()}
    for _ in range(updates):
        batch = _batch(grid, theta, drives, chance)
        means.append(sum(one.total for one in batch) / drives)
        slopes = {square: [0.0, 0.0, 0.0] for square in theta}
        for one, weight in zip(batch, weights([one.total for one in batch], has_baseline=True), strict=True):
            for square, move in zip(one.squares, one.moves, strict=False):
                row = drive_row(theta[square], move, weight / drives)
                slopes[square] = [before + more for before, more in zip(slopes[square], row, strict=True)]
        theta = {square: climbed(theta[square], slopes[square], step) for square in theta}
    return means


def _batch(grid: Grid, theta: Mapping[Square, Sequence[float]], count: int, chance: Chance) -> list[Drive]:
    pi = {square: probabilities(one) for square, one in theta.items()}
    return [drive_by(grid, lambda square: drawn(pi[square], chance)) for _ in range(count)]


def drawn(pi: Sequence[float], chance: Chance) -> int:
    """Return a move drawn by its probability."""
    share = chance.share()
    return 0 if share < pi[0] else 1 if share < pi[0] + pi[1] else 2
