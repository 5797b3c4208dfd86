"""Whether one group of seeds is better than another, in sentences that say no more than the seeds allow.

Begin with `verdict_of`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from racecraft.evaluation.fresh_starts import FreshScores
from racecraft.evaluation.run_groups import Difference
from racecraft.evaluation.seed_statistics import (
    BY_LUCK,
    GroupComparison,
    Interval,
    compare_groups,
    mean_interval,
)

MAX_NAMED = 4
COUNTS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


@dataclass(frozen=True)
class ScoredGroup:
    """A group of seeds with what fresh starts gave each of them."""

    name: str
    scores: tuple[FreshScores, ...]

    def seeds(self, by_fallback: bool) -> tuple[float, ...]:
        """Return one number a seed: its score, or what tells seeds apart that reach no goal."""
        return tuple(one.fallback if by_fallback else one.score for one in self.scores)


@dataclass(frozen=True)
class Measure:
    """What seeds are compared by."""

    name: str
    unit: str
    less_is_better: bool
    by_fallback: bool

    def written(self, value: float) -> str:
        """Return a value with its unit."""
        return "no lap" if math.isinf(value) else f"{value:.2f}{self.unit}"


@dataclass(frozen=True)
class Verdict:
    """What two or more groups came to; groups stand in the order of their merit."""

    measure: Measure
    order: tuple[int, ...]
    """The groups, the best first."""
    means: tuple[Interval, ...]
    """Interquartile mean of each group's seeds, in the order the groups were given."""
    comparison: GroupComparison | None
    """The best group against the next; None of one group."""
    sentences: tuple[str, ...]

    @property
    def is_clear(self) -> bool:
        """Whether luck alone makes such a difference at most once in twenty."""
        return self.comparison is not None and self.comparison.luck <= BY_LUCK


def verdict_of(groups: Sequence[ScoredGroup], differing: Sequence[Difference]) -> Verdict:
    """Return which group is better, how sure that is, and whether its cause can be told.

    Args:
        groups: One at least.
        differing: The settings in which they differ.
    """
    measure = _measure(groups)
    seeds = [group.seeds(measure.by_fallback) for group in groups]
    means = tuple(mean_interval(one) for one in seeds)
    sign = 1.0 if measure.less_is_better else -1.0
    order = tuple(sorted(range(len(groups)), key=lambda k: (sign * means[k].value, k)))
    if len(groups) == 1:
        return Verdict(measure, order, means, None, (_alone(groups[0], seeds[0], means[0], measure),))
    first, second = _by_pairs(order, seeds, measure)
    comparison = compare_groups(seeds[first], seeds[second], measure.less_is_better)
    sentences = _sentences(groups, seeds, means, (first, second), comparison, measure)
    several = _of_several(len(groups))
    return Verdict(measure, order, means, comparison, (*sentences, *several, *_cause(comparison, differing)))


def _measure(groups: Sequence[ScoredGroup]) -> Measure:
    """Return the goal's measure, or the fallback where no seed reaches the goal."""
    first = groups[0].scores[0]
    if any(math.isfinite(one.score) for group in groups for one in group.scores):
        name, _, unit = first.name.partition(", ")
        return Measure(name, f" {unit}" if unit else "", first.less_is_better, False)
    return Measure("progress", " %", False, True)


def _by_pairs(order: tuple[int, ...], seeds: Sequence[Sequence[float]], measure: Measure) -> tuple[int, int]:
    """Return the best two groups, in front the one that wins more pairs of seeds."""
    first, second = order[0], order[1]
    won = compare_groups(seeds[first], seeds[second], measure.less_is_better)
    return (first, second) if won.probability.value >= 0.5 else (second, first)


def _alone(group: ScoredGroup, seeds: Sequence[float], mean: Interval, measure: Measure) -> str:
    ordered = sorted(seeds, reverse=not measure.less_is_better)
    best, worst = measure.written(ordered[0]), measure.written(ordered[-1])
    if len(seeds) == 1:
        return f"{group.name}: {measure.name} {best} on fresh starts. One seed tells nothing of the next one."
    if math.isinf(mean.value):
        missing = _count(sum(math.isinf(one) for one in seeds))
        return (
            f"{group.name}: {missing} of {_count(len(seeds))} seeds bring no lap; the best {best}, the worst {worst}."
        )
    spread = "" if mean.low is None else f" (95 %: {mean.low:.2f} to {measure.written(mean.high or mean.low)})"
    return (
        f"{group.name}: {measure.name} {measure.written(mean.value)}{spread}, interquartile mean of "
        f"{_count(len(seeds))} seeds; the best {best}, the worst {worst}."
    )


def _sentences(
    groups: Sequence[ScoredGroup],
    seeds: Sequence[Sequence[float]],
    means: Sequence[Interval],
    pair: tuple[int, int],
    comparison: GroupComparison,
    measure: Measure,
) -> tuple[str, ...]:
    first, second = pair
    better, other = groups[first].name, groups[second].name
    counts = len(seeds[first]), len(seeds[second])
    won, pairs = comparison.pairs_won, comparison.pairs
    if won == pairs / 2:
        return (f"No difference between {better} and {other}: each wins half of the {pairs} pairs of seeds.",)
    if counts == (1, 1):
        return (
            f"{better} was better this time ({_gap(means, pair, measure)}). One seed a side tells nothing: luck alone "
            "decides every second such pair. Train five of each (--seeds 5).",
        )
    gap = _gap(means, pair, measure)
    share = (
        f"Each of its {_count(counts[0])} seeds beats every seed of {other}."
        if won == pairs
        else f"It wins {won:g} of {pairs} pairs of seeds."
    )
    luck = (
        f"With {_count(counts[0])} seeds against {_count(counts[1])}, luck alone does that {_once_in(comparison.luck)}."
    )
    if comparison.luck <= BY_LUCK:
        return (f"Better: {better} ({gap}).", share, luck)
    more = f"More seeds would tell (--seeds {max(5, 2 * min(counts))})."
    values = sorted((means[first].value, means[second].value), reverse=not measure.less_is_better)
    looks = "looks better" if means[first].value == values[0] else "wins more pairs of seeds but has the worse mean"
    return (f"No verdict. {better} {looks} ({gap}).", share, luck, more)


def _gap(means: Sequence[Interval], pair: tuple[int, int], measure: Measure) -> str:
    """Return the two interquartile means, and how far they are apart where both are figures."""
    values = [means[k].value for k in pair]
    text = " against ".join(measure.written(value) for value in values)
    if not np.isfinite(values).all():
        return f"{measure.name} {text}"
    return f"{measure.name} {text}, by {measure.written(abs(values[1] - values[0]))}"


def _of_several(groups: int) -> tuple[str, ...]:
    if groups < 3:
        return ()
    return (f"It is the best of {_count(groups)} groups: the best of several looks better than it is.",)


def _cause(comparison: GroupComparison, differing: Sequence[Difference]) -> tuple[str, ...]:
    """Return what can be said of the cause."""
    names = [one.name for one in differing]
    if not names:
        return ("No setting differs: what you see is luck.",)
    if len(names) > 1:
        text = ", ".join(names[:MAX_NAMED]) + (" …" if len(names) > MAX_NAMED else "")
        return (f"{_count(len(names)).capitalize()} settings differ ({text}): the cause cannot be told.",)
    if comparison.luck <= BY_LUCK:
        return (f"One setting differs, {names[0]}: where it is not luck, that made the difference.",)
    return (f"One setting differs, {names[0]}.",)


def _once_in(share: float) -> str:
    """Return a probability in words.

    >>> _once_in(0.05), _once_in(0.5), _once_in(0.7)
    ('once in 20', 'once in 2', 'more often than not')
    """
    return "more often than not" if share > 0.5 else f"once in {round(1.0 / share):,}"


def _count(number: int) -> str:
    return COUNTS[number] if number < len(COUNTS) else str(number)
