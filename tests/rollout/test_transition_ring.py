"""What a ring keeps and where, by hand: shapes, seams, last observations, stacks, and what goes into a file."""

import numpy as np
import pytest

from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.algorithms.stacking import AGE
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.rollout.transition_ring import TransitionRing, ring_bytes, ring_layout

GAMMA = 0.5
NUMBER = {"number": ArraySpec((1,), np.float32)}
NOTED = {AGE: ArraySpec((), np.int16)}


def spec_of(worlds=1, agents=1, mask=False, seen=NUMBER):
    return WorldSpec("counting", worlds, agents, seen, DiscreteActions(3), has_action_mask=mask)


def shown(numbers):
    return {"number": np.asarray(numbers, np.float32)[..., None]}


def ticks(first, count, rows=1, cut=(), age=None, last=None):
    """Return ticks that show tick + 1000 * row and pay tick + 1; those in `cut` (tick, row) end in number + 500."""
    number = np.arange(first, first + count + 1)[:, None] + 1000 * np.arange(rows)
    truncated = np.zeros((count, rows), bool)
    for tick, row in cut:
        truncated[tick - first, row] = True
    ends = np.flatnonzero(truncated)
    return RolloutBatch(
        observations=shown(number[:-1]),
        actions=number[:-1] % 3,
        reward=(number[:-1] % 1000 + 1).astype(np.float32),
        terminated=np.zeros((count, rows), bool),
        truncated=truncated,
        active=np.ones((count, rows), bool),
        last_observations=shown(number[-1] if last is None else last),
        last_active=np.ones(rows, bool),
        columns={} if age is None else {AGE: np.asarray(age, np.int16)},
        final_index=ends,
        final_observations=shown(number[:-1].reshape(-1)[ends] + 500) if len(ends) else {},
    )


def next_of(ring, places, n_step=1):
    return ring.gather(np.array(places), n_step, GAMMA).next_observations["number"][:, 0].tolist()


@pytest.mark.parametrize(("kept", "finals"), [(50, 19), (20, 12)])
def test_a_ring_has_a_slot_more_than_ticks_and_room_for_one_last_observation_in_sixteen(kept, finals):
    """Of 3 worlds of 2 agents: 51 x 6 / 16 are 19; and never less than two for each row."""
    seen = {"frame": ArraySpec((4, 5), np.uint8), "speed": ArraySpec((), np.float64)}
    columns = {"noted": ArraySpec((2,), np.int16)}
    spec = spec_of(3, 2, mask=True, seen=seen)
    assert ring_layout(spec, kept, columns) == {
        "actions": ((kept + 1, 6), np.int64),
        "reward": ((kept + 1, 6), np.float32),
        "end": ((kept + 1, 6), np.uint8),
        "active": ((kept + 1, 6), bool),
        "final_at": ((kept + 1, 6), np.int32),
        "final_owner": ((finals,), np.int64),
        "mask": ((kept + 1, 6, 3), bool),
        "observations/frame": ((kept + 1, 6, 4, 5), np.uint8),
        "finals/frame": ((finals, 4, 5), np.uint8),
        "observations/speed": ((kept + 1, 6), np.float64),
        "finals/speed": ((finals,), np.float64),
        "columns/noted": ((kept + 1, 6, 2), np.int16),
    }
    ring = TransitionRing(spec, kept, columns)
    assert (ring.rows, ring.ticks, ring.slots) == (6, kept, kept + 1)
    assert sum(array.nbytes for array in ring.arrays.values()) == ring_bytes(spec, kept, columns)
    assert ring.arrays["mask"].shape == (kept + 1, 6, 3)
    assert "mask" not in ring_layout(spec_of(3, 2), kept, {})


def test_the_oldest_tick_is_as_many_back_as_are_kept():
    ring, oldest = TransitionRing(spec_of(), 4), []
    for first in range(0, 8, 2):
        ring.put(ticks(first, 2))
        oldest.append((ring.oldest, ring.head))
    assert oldest == [(0, 2), (0, 4), (2, 6), (4, 8)]


def test_only_what_was_written_is_told_and_a_ring_goes_on_from_it():
    ring = TransitionRing(spec_of(2), 10)
    ring.put(ticks(0, 3, 2, cut=[(1, 1)]))
    told = ring.state()
    assert told["counts"].tolist() == [3, 1]
    assert told["observations/number"][:, :, 0].tolist() == [[0, 1000], [1, 1001], [2, 1002], [3, 1003]]
    assert {name: len(array) for name, array in told.items() if name != "counts"} == {
        "actions": 4, "reward": 4, "end": 4, "active": 4, "final_at": 4, "observations/number": 4,
        "final_owner": 1, "finals/number": 1,
    }  # fmt: skip
    again = TransitionRing(spec_of(2), 10)
    again.restore(told)
    ring.arrays["reward"][:] = -1.0  # what was told is a copy
    assert (again.head, again.finals_put) == (3, 1)
    again.put(ticks(3, 2, 2))
    assert next_of(again, [1, 3, 6, 7]) == [1001.0, 1501.0, 4.0, 1004.0]
    assert again.flat("reward")[:10].tolist() == [1, 1, 2, 2, 3, 3, 4, 4, 5, 5]


def test_a_ring_that_has_gone_round_tells_all_its_slots():
    ring = TransitionRing(spec_of(2), 4)
    ring.put(ticks(0, 9, 2, cut=[(tick, row) for tick in range(3, 9) for row in range(2)]))
    told = ring.state()
    assert told["counts"].tolist() == [9, 8], "of what was skipped no last observation is kept"
    assert len(told["reward"]) == 5
    assert len(told["final_owner"]) == len(told["finals/number"]) == 4


def test_last_observations_beyond_their_room_oust_the_oldest_that_are_still_remembered():
    """Room for four of two rows. Six come: the first two make room. Four more: one is older than all that is kept."""
    ring = TransitionRing(spec_of(2), 4)
    assert ring.put(ticks(0, 4, 2, cut=[(tick, row) for tick in range(3) for row in range(2)])).tolist() == [0, 1]
    assert ring.flat("active").tolist() == [False] * 2 + [True] * 6 + [False] * 2
    assert next_of(ring, [2, 3, 4, 5, 6]) == [501.0, 1501.0, 502.0, 1502.0, 4.0]
    given_up = ring.put(ticks(4, 2, 2, cut=[(4, 0), (4, 1), (5, 0), (5, 1)]))
    assert given_up.tolist() == [4, 5], "tick 1 is forgotten already, tick 2 is the oldest that is kept"
    assert next_of(ring, [8, 9, 0, 1]) == [504.0, 1504.0, 505.0, 1505.0]


def test_what_is_not_a_number_goes_on_like_any_other():
    ring = TransitionRing(spec_of(2), 10)
    ring.put(ticks(0, 2, 2, last=[np.nan, 1002.0]))
    following = ticks(2, 2, 2)
    following.observations["number"][0, 0] = np.nan
    ring.put(following)
    assert ring.finals_put == 0
    assert ring.look_ahead(np.array([2, 3]), 3, GAMMA)[0].tolist() == [2 + 3 / 2 + 4 / 4] * 2


def test_the_mask_after_the_newest_tick_is_known_as_soon_as_it_is_seen():
    batch = ticks(0, 2, 2)
    batch.action_mask = np.zeros((2, 2, 3), bool)
    batch.action_mask[1] = [[True, False, False], [False, True, False]]
    batch.last_action_mask = np.array([[False, False, True], [True, True, False]])
    ring = TransitionRing(spec_of(2, mask=True), 5)
    ring.put(batch)
    drawn = ring.gather(np.array([0, 3]), 1, GAMMA)
    assert drawn.action_mask.tolist() == [[False] * 3, [False, True, False]]
    assert drawn.next_action_mask.tolist() == [[True, False, False], [True, True, False]]


def test_what_is_privileged_is_not_stacked():
    seen = {**NUMBER, "truth": ArraySpec((1,), np.float32, privileged=True)}
    ring = TransitionRing(spec_of(1, seen=seen), 5, NOTED, stack_size=2)
    assert list(ring.stacked) == ["number"]
    batch = ticks(0, 3, age=[[0], [1], [1]])
    batch.observations["truth"] = batch.observations["number"] * 10
    batch.last_observations["truth"] = batch.last_observations["number"] * 10
    ring.put(batch)
    drawn = ring.gather(np.array([2]), 1, GAMMA)
    assert drawn.observations["number"].tolist() == [[1, 2]]
    assert drawn.observations["truth"].tolist() == [[20]]
    assert drawn.next_observations["truth"].tolist() == [[30]]
