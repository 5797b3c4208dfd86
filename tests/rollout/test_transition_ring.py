"""What a ring keeps and where, by hand: shapes, seams, last observations, stacks, and what goes into a file."""

import numpy as np
import pytest

from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.algorithms.stacking import AGE
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.rollout.kernels.n_step import NOBODY
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


def test_the_bytes_of_a_ring_are_summed_by_hand():
    """Two rows, four ticks: 10 places of 8 + 4 + 1 + 1 + 4 bytes and 4 of a number; room for 4 finals of 8 + 4."""
    assert ring_bytes(spec_of(2), 4, {}) == 10 * (18 + 4) + 4 * (8 + 4)


def test_places_are_numbered_slot_by_slot_and_the_ring_closes():
    ring = TransitionRing(spec_of(1, 2), 3)
    assert ring.places(2, 5).tolist() == [4, 5, 6, 7, 0, 1]
    assert ring.places(2, 2).tolist() == []


def test_a_new_ring_holds_nothing():
    ring = TransitionRing(spec_of(2), 4)
    assert (ring.head, ring.finals_put, ring.oldest, ring.stack_size) == (0, 0, 0, 1)
    assert (ring.arrays["final_owner"] == NOBODY).all()
    assert not any(array.any() for name, array in ring.arrays.items() if name != "final_owner")


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


def test_what_was_seen_last_stands_for_the_end_of_an_episode_that_does_not_go_on():
    ring = TransitionRing(spec_of(2), 10)
    ring.put(ticks(0, 2, 2))
    other = ticks(2, 2, 2)
    other.observations["number"][0, 1] = 7.0
    assert ring.put(other).tolist() == []
    total, weight, then, cut = ring.look_ahead(np.array([2, 3]), 2, GAMMA)
    assert total.tolist() == [2 + 3 / 2, 2.0]
    assert weight.tolist() == [0.25, 0.5]
    assert cut.tolist() == [NOBODY, 3]
    assert then.tolist() == [6, 5]
    assert next_of(ring, [2, 3]) == [2.0, 1002.0]
    assert [part.dtype for part in (total, weight, then, cut)] == [np.float32, np.float32, np.int64, np.int64]


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


def test_columns_that_nobody_asked_to_keep_are_left_out():
    ring = TransitionRing(spec_of(), 5)
    ring.put(ticks(0, 2, age=[[0], [1]]))
    assert [name for name in ring.arrays if name.startswith("columns")] == []
    assert next_of(ring, [0, 1]) == [1.0, 2.0]


def test_what_is_drawn_says_where_it_lies_and_weighs_alike():
    ring = TransitionRing(spec_of(2), 5)
    ring.put(ticks(0, 3, 2))
    drawn = ring.gather(np.array([3, 0, 3]), 1, GAMMA)
    assert drawn.index.tolist() == [3, 0, 3]
    assert drawn.weights.tolist() == [1.0, 1.0, 1.0]
    assert drawn.actions.tolist() == [1001 % 3, 0, 1001 % 3]
    assert drawn.observations["number"].tolist() == [[1001], [0], [1001]]
    assert (drawn.action_mask, drawn.next_action_mask) == (None, None)


# ---- stacks ----------------------------------------------------------------------------------------------------------


def stacked_ring():
    """Two rows, six ticks kept of ten, stacks of three: one long episode, and one that is cut at tick 4."""
    ring = TransitionRing(spec_of(2), 6, NOTED, stack_size=3)
    age = [[min(tick, 2), min(tick if tick < 5 else tick - 5, 2)] for tick in range(10)]
    for first in (0, 3, 7):
        count = 4 if first == 3 else 3
        ring.put(ticks(first, count, 2, cut=[(4, 1)] if first == 3 else (), age=age[first : first + count]))
    return ring


def at(tick, row):
    return tick % 7 * 2 + row


def test_a_stack_reaches_back_as_far_as_the_episode_and_the_ring_do():
    drawn = stacked_ring().gather(np.array([at(tick, row) for tick in range(4, 8) for row in range(2)]), 1, GAMMA)
    assert drawn.observations["number"].tolist() == [
        [4, 4, 4], [1004, 1004, 1004],  # the oldest that is remembered
        [4, 4, 5], [1005, 1005, 1005],  # the second episode begins
        [4, 5, 6], [1005, 1005, 1006],
        [5, 6, 7], [1005, 1006, 1007],
    ]  # fmt: skip


def test_what_follows_is_stacked_on_what_came_before_it_also_where_an_episode_was_cut():
    drawn = stacked_ring().gather(np.array([at(4, 0), at(4, 1), at(5, 0), at(5, 1), at(9, 0)]), 1, GAMMA)
    assert drawn.next_observations["number"].tolist() == [
        [4, 4, 5], [1004, 1004, 1504], [4, 5, 6], [1005, 1005, 1006], [8, 9, 10]
    ]  # fmt: skip
    further = stacked_ring().gather(np.array([at(5, 0), at(7, 1)]), 2, GAMMA)
    assert further.next_observations["number"].tolist() == [[5, 6, 7], [1007, 1008, 1009]]


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
