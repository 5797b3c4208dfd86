"""A memory that is full drops whole episodes, in the order of their numbers."""

import numpy as np

from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.rollout.memory import within_memory


def driven(lengths, extra=0):
    """Return the experience of cars whose episodes had these lengths, (R, quota); ticks after the quota inactive."""
    ends = [np.cumsum(row) - 1 for row in lengths]
    ticks = max(int(end[-1]) for end in ends) + 1 + extra
    ended, active = np.zeros((ticks, len(lengths)), bool), np.zeros((ticks, len(lengths)), bool)
    for i, end in enumerate(ends):
        ended[end, i] = True
        active[: end[-1] + 1, i] = True
        ended[end[-1] + 1 :: 2, i] = True  # what a car does after its quota
    nothing = np.zeros(ended.shape, np.float32)
    last = np.ones(len(lengths), bool)
    return RolloutBatch({}, nothing, nothing, ended, np.zeros_like(ended), active, {}, last)


def kept_lengths(kept, lengths):
    """Return how many ticks of each episode are still active."""
    found = []
    for i, row in enumerate(lengths):
        begins = np.cumsum([0, *row])
        found.append([int(kept.active[a:b, i].sum()) for a, b in zip(begins[:-1], begins[1:], strict=True)])
    return found


def test_everything_stays_where_there_is_room():
    lengths = [[3, 4], [5, 2]]
    before = driven(lengths, extra=6)
    kept = within_memory(before, 2, 14)
    assert (kept.active == before.active).all()


def test_the_first_episode_without_room_closes_the_memory_for_all_later_ones():
    # numbers:  0: 3   1: 5   2: 9 (does not fit into 16)   3: 1 (would fit, but is later)
    lengths = [[3, 9], [5, 1]]
    kept = within_memory(driven(lengths), 2, 16)
    assert kept_lengths(kept, lengths) == [[3, 0], [5, 0]]


def test_no_episode_is_ever_cut_in_two():
    rng = np.random.default_rng(4)
    for _ in range(50):
        lengths = rng.integers(2, 30, (rng.integers(1, 6), rng.integers(1, 5))).tolist()
        cap = int(rng.integers(1, 200))
        kept = within_memory(driven(lengths, extra=5), len(lengths[0]), cap)
        found = kept_lengths(kept, lengths)
        assert all(
            n in (0, length) for a, b in zip(found, lengths, strict=True) for n, length in zip(a, b, strict=True)
        )
        assert kept.active.sum() == sum(map(sum, found)) <= cap


def test_ticks_that_were_inactive_count_and_stay_inactive():
    lengths = [[4], [4]]
    before = driven(lengths)
    before.active[0] = False  # prepare
    assert within_memory(before, 1, 7).active.sum() == 3
    assert within_memory(before, 1, 8).active.sum() == 6
