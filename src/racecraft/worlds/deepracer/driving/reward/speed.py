"""Whether a reward teaches speed: what laps earn, from the fastest to the slowest. Begin with `judge_speed`.

Two figures are set against the lap time. The sum over a lap is what an episode of one lap earns; the pay a second is
what counts where laps go on, or where the discount looks less far than a lap.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from racecraft.contract.message import figure
from racecraft.contract.world import Array

LAPPING, SPEED, PACE, NEITHER = "lapping", "speed", "pace", "neither"
STRONG = 0.5
"""A rank correlation from which on the order counts as told."""
SAME = 0.2
"""Sums of slow and fast laps that differ by less than this share of either count as the same."""


@dataclass(frozen=True)
class SpeedVerdict:
    """What slow and fast laps earn."""

    teaches: str
    """LAPPING: slow laps earn clearly more; SPEED: fast laps earn clearly more; PACE: laps earn about the same, so fast
    ones earn more a second; NEITHER: lap time hardly matters."""
    sum_rank: float
    """Rank correlation of a lap's summed reward with its time, -1 to 1, mean over tracks; positive: slow laps earn
    more."""
    rate_rank: float
    """Of the reward a second with the lap time; negative: fast laps earn more a second."""
    fast_sum: float
    """Mean sum of the fastest third of the laps."""
    slow_sum: float
    """Of the slowest third."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return asdict(self)

    @property
    def sentence(self) -> str:
        """The verdict in words."""
        fast, slow = figure(self.fast_sum), figure(self.slow_sum)
        sums = f"the fastest third of the laps earns {fast} each, the slowest third {slow}"
        return {
            LAPPING: f"teaches lapping, not speed: {sums}",
            SPEED: f"teaches speed: {sums}",
            PACE: f"teaches speed through time: {sums}, so a fast car earns more a second",
            NEITHER: f"lap time hardly matters to it: {sums}",
        }[self.teaches]


def judge_speed(laps: list[tuple[str, float, float]]) -> SpeedVerdict:
    """Return what a reward teaches.

    Args:
        laps: Of each lap its track, its time (s) and its summed reward.
    """
    tracks = sorted({track for track, _, _ in laps})
    per_track = [np.array([(seconds, earned) for of, seconds, earned in laps if of == track]) for track in tracks]
    sum_rank = float(np.mean([spearman(rows[:, 0], rows[:, 1]) for rows in per_track]))
    rate_rank = float(np.mean([spearman(rows[:, 0], rows[:, 1] / rows[:, 0]) for rows in per_track]))
    thirds = [_thirds(rows) for rows in per_track]
    fast, slow = (float(np.mean([pair[k] for pair in thirds])) for k in (0, 1))
    return SpeedVerdict(_verdict(sum_rank, rate_rank, fast, slow), sum_rank, rate_rank, fast, slow)


def _verdict(sum_rank: float, rate_rank: float, fast: float, slow: float) -> str:
    alike = abs(slow - fast) <= SAME * max(abs(slow), abs(fast))
    if not alike and sum_rank >= STRONG:
        return LAPPING
    if not alike and sum_rank <= -STRONG:
        return SPEED
    return PACE if rate_rank <= -STRONG else NEITHER


def _thirds(rows: Array) -> tuple[float, float]:
    by_time = rows[np.argsort(rows[:, 0])]
    third = max(1, len(rows) // 3)
    return float(by_time[:third, 1].mean()), float(by_time[-third:, 1].mean())


def spearman(a: Array, b: Array) -> float:
    """Return the rank correlation of two lists, -1 to 1; 0 where one of them is constant.

    >>> spearman(np.array([1.0, 2.0, 3.0]), np.array([10.0, 20.0, 15.0]))
    0.5
    """
    if len(a) < 2:
        return 0.0
    ranks = [_ranks(np.asarray(values, float)) for values in (a, b)]
    spread = [one - one.mean() for one in ranks]
    scale = np.sqrt((spread[0] ** 2).sum() * (spread[1] ** 2).sum())
    return float((spread[0] * spread[1]).sum() / scale) if scale > 0.0 else 0.0


def _ranks(values: Array) -> Array:
    """Return the rank of each value, equal values the mean of theirs; values that differ by rounding are equal."""
    rounded = np.array([float(f"{value:.9g}") for value in values])
    _, inverse, counts = np.unique(rounded, return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - (counts - 1) / 2.0)[inverse]
