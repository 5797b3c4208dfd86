"""Follow the story of transitions for some ticks: what it pays, whether it ended, what is seen then."""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import Array
from racecraft.kernels import kernel

GOES_ON, TERMINATED, TRUNCATED = 0, 1, 2
"""How a tick ended."""
NOBODY = -1
U = np.uint64


@kernel
def follow(
    reward: Array, end: Array, active: Array, index: Array, rows: int, n_step: int, gamma: float,
    total: Array, weight: Array, then: Array, cut: Array,
) -> None:  # fmt: skip
    """Follow B stories through a ring of ticks, each for `n_step` ticks at most.

    Args:
        reward: float32 (P,), by place.
        end: uint8 (P,): `GOES_ON`, `TERMINATED` or `TRUNCATED`.
        active: bool (P,): what may be learned from; a story stops before a tick that may not.
        index: int64 (B,), where each begins.
        rows: Places of one tick; the next tick of the same row is so much further.
        n_step: 1 or more.
        gamma: float32, weight of the next tick.
        total: float32 (B,), written: the discounted sum of rewards.
        weight: float32 (B,), written: gamma to the power of the steps, 0 where it terminated.
        then: int64 (B,), written: the place of what is seen after it.
        cut: int64 (B,), written: the last tick's place where that tick was cut, `NOBODY` elsewhere.
    """
    places, step = U(len(reward)), U(rows)
    for i in range(len(index)):
        at = U(index[i])
        paid, worth, ended = reward[at], gamma, end[at]
        last, at = at, _after(at, step, places)
        for _ in range(n_step - 1):
            if ended != GOES_ON or not active[at]:
                break
            paid += worth * reward[at]
            worth *= gamma
            ended = end[at]
            last, at = at, _after(at, step, places)
        total[i] = paid
        weight[i] = np.float32(0.0) if ended == TERMINATED else worth
        then[i] = np.int64(at)
        cut[i] = np.int64(last) if ended == TRUNCATED else NOBODY


@kernel
def _after(place: np.uint64, step: np.uint64, places: np.uint64) -> np.uint64:
    """Return the place one tick later; the ring closes."""
    further = place + step
    return further - places if further >= places else further
