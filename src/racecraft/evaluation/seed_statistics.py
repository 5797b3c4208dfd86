"""What several seeds can tell: interquartile mean, bootstrap intervals, the chance that one group beats another.

The words and the aggregates are those of rliable (Agarwal et al. 2021, "Deep reinforcement learning at the edge of the
statistical precipice"); the code is NumPy alone. A score is one number a seed. Begin with `compare_groups`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from math import comb

import numpy as np

from racecraft.contract.random_streams import generator
from racecraft.contract.world import Array

RESAMPLES = 2000
CONFIDENCE = 0.95
MIN_SEEDS = 3
"""Of fewer seeds a bootstrap interval would only be their range."""
MAX_SPLITS = 20_000
"""So many ways to part the seeds are all counted; of more, as many are drawn."""
BY_LUCK = 0.05
"""A difference that luck alone makes at most so often is called one."""


@dataclass(frozen=True)
class Interval:
    """A figure with its CONFIDENCE interval."""

    value: float
    low: float | None
    """None where there are too few seeds for an interval."""
    high: float | None


@dataclass(frozen=True)
class GroupComparison:
    """Two groups of seeds, A and B."""

    probability: Interval
    """That a seed of A beats a seed of B, a draw counted half; 0.5: none is better."""
    pairs_won: float
    """Of `pairs`, draws counted half."""
    pairs: int
    luck: float
    """How often seeds that differ in nothing come out at least as far apart, in this direction: an exact permutation
    test of the pairs won."""


def interquartile_mean(scores: Sequence[float] | Array) -> float:
    """Return the mean of the middle half; the seeds at its edges count in part.

    >>> interquartile_mean([1.0, 2.0, 3.0, 100.0])
    2.5
    >>> round(interquartile_mean([1.0, 2.0, 6.0]), 9)
    2.5
    """
    return float(_interquartile_means(np.asarray(scores, float)[None])[0])


def mean_interval(scores: Sequence[float] | Array) -> Interval:
    """Return the interquartile mean of a group's seeds with its percentile bootstrap interval."""
    scores = np.asarray(scores, float)
    value = interquartile_mean(scores)
    if len(scores) < MIN_SEEDS or not np.isfinite(scores).all():
        return Interval(value, None, None)
    drawn = scores[_resampled(len(scores), "a group's seeds")]
    return Interval(value, *_percentiles(_interquartile_means(drawn)))


def compare_groups(a: Sequence[float] | Array, b: Sequence[float] | Array, less_is_better: bool) -> GroupComparison:
    """Compare two groups of seeds, A and B.

    Args:
        a: A score for each seed of A; one of them at least. Infinite scores are worse, or better, than all others.
        b: A score for each seed of B.
        less_is_better: Whether smaller scores are better, such as lap times.

    >>> clean = compare_groups([1.0, 2.0, 3.0], [4.0, 5.0, 6.0], less_is_better=True)
    >>> clean.probability.value, clean.pairs_won, clean.pairs, clean.luck
    (1.0, 9.0, 9, 0.05)
    """
    sign = -1.0 if less_is_better else 1.0
    first, second = sign * np.asarray(a, float), sign * np.asarray(b, float)
    won = _wins(first, second)
    value = float(won.mean())
    ends: tuple[float | None, float | None] = (None, None)
    if min(len(first), len(second)) >= MIN_SEEDS:
        rows, columns = (_resampled(len(one), name) for one, name in ((first, "seeds of A"), (second, "seeds of B")))
        ends = _percentiles(won[rows[:, :, None], columns[:, None, :]].mean(axis=(1, 2)))
    return GroupComparison(Interval(value, *ends), float(won.sum()), won.size, _by_luck(first, second))


def _wins(first: Array, second: Array) -> Array:
    """Return (A, B) 1 where the seed of A is better, 0.5 where they are equal."""
    ahead = first[:, None] > second[None, :]
    return np.asarray(ahead + 0.5 * (first[:, None] == second[None, :]))


def _by_luck(first: Array, second: Array) -> float:
    """Return the share of all ways to part the seeds in which A's win as many pairs at least."""
    everybody, count = np.concatenate([first, second]), len(first)
    table = _wins(everybody, everybody)
    observed = _wins(first, second).sum() - 1e-9
    whole = len(everybody)
    if comb(whole, count) <= MAX_SPLITS:
        rows = np.array(list(combinations(range(whole), count)))
    else:
        rng = generator(0, "parted seeds")
        rows = rng.permuted(np.tile(np.arange(whole), (MAX_SPLITS, 1)), axis=1)[:, :count]
    is_first = np.zeros((len(rows), whole))
    np.put_along_axis(is_first, rows, 1.0, axis=1)
    won = ((is_first @ table) * (1.0 - is_first)).sum(axis=1)
    return float((won >= observed).mean())


def _interquartile_means(scores: Array) -> Array:
    """Return the interquartile mean (R,) of each row of scores (R, S)."""
    ordered = np.sort(scores, axis=1)
    edges = np.arange(ordered.shape[1] + 1) / ordered.shape[1]
    share = np.clip(np.minimum(edges[1:], 0.75) - np.maximum(edges[:-1], 0.25), 0.0, None)
    counted = share > 1e-12  # an infinite score at the edge does not count
    return np.asarray(ordered[:, counted] @ share[counted] / share[counted].sum())


def _resampled(count: int, purpose: str) -> Array:
    return generator(0, purpose).integers(0, count, (RESAMPLES, count))


def _percentiles(values: Array) -> tuple[float, float]:
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(values, (tail, 100.0 - tail))
    return float(low), float(high)
