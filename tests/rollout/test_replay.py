"""The replay by hand: n steps ahead, ends and cuts apart, each frame once, drawn as often as promised."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.replay_sampler import VALUE_BEST, VALUE_TAKEN
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.rollout import replay as memory
from racecraft.rollout.kernels.n_step import NOBODY, TERMINATED, TRUNCATED
from racecraft.rollout.priorities import Priorities
from racecraft.rollout.replay import Replay
from racecraft.rollout.replay_settings import ReplayConfig
from racecraft.rollout.transition_ring import TransitionRing

GAMMA = 0.5


def world(rows, mask=False):
    seen = {"number": ArraySpec((1,), np.float32), "frame": ArraySpec((2, 3), np.uint8)}
    return WorldSpec("counting", rows, 1, seen, DiscreteActions(3), has_action_mask=mask)


def seen(numbers):
    numbers = np.asarray(numbers)
    return {
        "number": numbers[..., None].astype(np.float32),
        "frame": np.broadcast_to(numbers[..., None, None] % 256, (*numbers.shape, 2, 3)).astype(np.uint8),
    }


def ticks(first, count, rows=1, terminated=(), truncated=(), inactive=(), mask=None):
    """Return ticks of a world that shows tick + 1000 * row, pays tick + 1, and ends where it is told (tick, row)."""
    shape = (count, rows)
    number = np.arange(first, first + count + 1)[:, None] + 1000 * np.arange(rows)
    flags = {}
    for name, where in (("terminated", terminated), ("truncated", truncated), ("inactive", inactive)):
        flags[name] = np.zeros(shape, bool)
        for tick, row in where:
            if first <= tick < first + count:
                flags[name][tick - first, row] = True
    cut = np.flatnonzero(flags["truncated"] & ~flags["terminated"])
    return RolloutBatch(
        observations=seen(number[:-1]),
        actions=number[:-1] % 3,
        reward=(number[:-1] % 1000 + 1).astype(np.float32),
        terminated=flags["terminated"],
        truncated=flags["truncated"],
        active=~flags["inactive"],
        last_observations=seen(number[-1]),
        last_active=np.ones(rows, bool),
        action_mask=None if mask is None else np.broadcast_to(mask, (*shape, 3)).copy(),
        last_action_mask=None if mask is None else np.broadcast_to(mask, (rows, 3)).copy(),
        final_index=cut,
        final_observations=seen(number[:-1].reshape(-1)[cut] + 500) if len(cut) else {},
    )


def gathered(ring, n_step, places):
    drawn = ring.gather(np.array(places), n_step, GAMMA)
    return [
        (float(reward), float(discount), float(then[0]))
        for reward, discount, then in zip(drawn.reward, drawn.discount, drawn.next_observations["number"], strict=True)
    ]


def test_three_steps_ahead_are_summed_by_hand():
    ring = TransitionRing(world(1), 10)
    ring.put(ticks(0, 8))
    # Tick 2 pays 3, then 4 and 5: 3 + 4 / 2 + 5 / 4, and tick 5 is looked at for an eighth.
    assert gathered(ring, 3, [2]) == [(3 + 2 + 1.25, 0.125, 5.0)]
    assert gathered(ring, 1, [2]) == [(3.0, 0.5, 3.0)]


def test_a_story_that_ended_pays_nothing_further_and_one_that_was_cut_goes_on_from_its_final_observation():
    ring = TransitionRing(world(2), 10)
    ring.put(ticks(0, 8, 2, terminated=[(3, 0)], truncated=[(3, 1)]))
    place = 2 * 2
    (ended, cut) = gathered(ring, 3, [place, place + 1])
    assert ended[:2] == (3 + 2, 0.0)
    assert cut == (3 + 2, 0.25, 1003 + 500.0)
    assert ring.gather(np.array([place + 1]), 3, GAMMA).next_observations["frame"][0, 0, 0] == 1503 % 256
    assert gathered(ring, 3, [4 * 2]) == [(5 + 3 + 7 / 4, 0.125, 7.0)], "the next episode is one of its own"


def test_both_at_once_is_an_end():
    ring = TransitionRing(world(1), 10)
    ring.put(ticks(0, 4, terminated=[(1, 0)], truncated=[(1, 0)]))
    assert gathered(ring, 1, [1])[0][:2] == (2.0, 0.0)


def test_no_story_runs_through_ticks_that_are_not_to_be_learned_from():
    ring = TransitionRing(world(1), 10)
    ring.put(ticks(0, 8, inactive=[(4, 0)]))
    assert gathered(ring, 3, [3]) == [(4.0, 0.5, 4.0)]


@pytest.mark.parametrize("pieces", [(20,), (3, 3, 3, 3, 3, 3, 2), (7, 13)])
def test_whatever_the_pieces_the_newest_ticks_are_kept(pieces):
    ring, first = TransitionRing(world(3), 6), 0
    for count in pieces:
        ring.put(ticks(first, count, 3, truncated=[(16, 1)]))
        first += count
    assert (ring.oldest, ring.head) == (14, 20)
    told = gathered(ring, 2, ring.places(14, 19))
    for place, (reward, discount, then) in enumerate(told):
        tick, row = 14 + place // 3, place % 3
        if row == 1 and tick in (15, 16):
            steps, then_expected = 17 - tick, 1016 + 500
        else:
            steps, then_expected = 2, tick + 2 + 1000 * row
        assert reward == sum((tick + 1 + k) * GAMMA**k for k in range(steps))
        assert (discount, then) == (GAMMA**steps, then_expected)


def followed_slowly(ring, place, n_step):
    """Return reward, discount, then and cut of one story, tick by tick, as the module says it."""
    reward, end, active = ring.flat("reward"), ring.flat("end"), ring.flat("active")
    total, weight = np.float32(0.0), np.float32(1.0)
    for step in range(n_step):
        if step and not active[place]:
            break
        total += weight * reward[place]
        weight *= np.float32(GAMMA)
        last, place = place, (place + ring.rows) % len(reward)
        if end[last] == TERMINATED:
            return total, 0.0, place, NOBODY
        if end[last] == TRUNCATED:
            return total, weight, place, last
    return total, weight, place, NOBODY


@pytest.mark.parametrize("n_step", [1, 5])
def test_stories_are_followed_as_a_slow_reader_follows_them(n_step):
    ring, rng = TransitionRing(world(3), 50), np.random.default_rng(n_step)
    for name, below in (("end", 3), ("active", 2)):
        dealt = rng.integers(0, below, ring.arrays[name].shape)
        ring.arrays[name][:] = np.where(rng.random(dealt.shape) < 0.3, dealt, below == 2)
    ring.arrays["reward"][:] = rng.normal(size=ring.arrays["reward"].shape)
    places = rng.integers(0, ring.slots * ring.rows, 500)
    told = ring.look_ahead(places, n_step, GAMMA)
    slowly = zip(*(followed_slowly(ring, place, n_step) for place in places), strict=True)
    for found, expected in zip(told, slowly, strict=True):
        np.testing.assert_array_equal(found, expected)


def test_each_frame_is_stored_once_in_its_own_type():
    ring = TransitionRing(world(4), 1000)
    assert ring.arrays["observations/frame"].shape == (1001, 4, 2, 3)
    assert ring.arrays["observations/frame"].dtype == np.uint8
    assert ring.gather(np.array([5]), 1, GAMMA).next_observations["frame"].dtype == np.uint8


def test_worlds_begun_anew_between_two_rollouts_cut_the_episodes_under_way():
    ring = TransitionRing(world(2), 20)
    ring.put(ticks(0, 4, 2, terminated=[(3, 0)]))
    ring.put(ticks(100, 4, 2))
    assert gathered(ring, 2, [2 * 2 + 1]) == [(3 + 2, 0.25, 1004.0)], "what was seen when it was broken off"
    assert gathered(ring, 2, [2 * 2])[0][:2] == (3 + 2, 0.0)


def test_more_final_observations_than_there_is_room_for_cost_the_oldest_ticks_their_place():
    ring = TransitionRing(world(1), 64)  # room for 4 finals
    given_up = ring.put(ticks(0, 60, truncated=[(tick, 0) for tick in range(0, 60, 10)]))
    assert given_up.tolist() == [0, 10]
    assert np.flatnonzero(~ring.flat("active")[:60]).tolist() == [0, 10]
    assert gathered(ring, 1, [20, 50]) == [(21, 0.5, 520.0), (51, 0.5, 550.0)]


def test_the_mask_of_a_final_observation_is_not_known_and_allows_everything():
    ring = TransitionRing(world(1, mask=True), 10)
    ring.put(ticks(0, 4, truncated=[(2, 0)], mask=[True, False, True]))
    drawn = ring.gather(np.array([1, 2]), 1, GAMMA)
    assert drawn.action_mask.tolist() == [[True, False, True]] * 2
    assert drawn.next_action_mask.tolist() == [[True, False, True], [True, True, True]]


def replay(rows=2, n_step=1, capacity=40, **settings):
    config = ReplayConfig(capacity=capacity, learning_starts=10, **settings)
    return Replay(world(rows), config, GAMMA, n_step)


def test_it_waits_until_enough_is_remembered_and_counts_what_is_new():
    one = replay()
    assert one.add(ticks(0, 4, 2)) is None
    assert one.add(ticks(4, 4, 2, inactive=[(5, 0), (6, 0)])) is one
    assert (len(one), one.new_transitions) == (14, 6)


def test_it_begins_with_exactly_as_many_as_were_asked_for():
    assert replay().add(ticks(0, 5, 2)) is not None
    assert replay().add(ticks(0, 5, 2, inactive=[(3, 1)])) is None


@pytest.mark.parametrize("prioritised", [False, True])
def test_only_ticks_to_learn_from_are_drawn_each_as_likely_and_none_whose_steps_are_not_all_seen(prioritised):
    one = replay(n_step=3, prioritised=prioritised)
    inactive = [(tick, 0) for tick in range(20, 40) if tick % 3]
    for first in range(0, 40, 8):
        one.add(ticks(first, 8, 2, inactive=inactive))
    drawn = one.sample(40_000, torch.Generator().manual_seed(1))
    number = drawn.observations["number"][:, 0].astype(int)
    allowed = {t for t in range(20, 38) if t % 3 == 0} | {1000 + t for t in range(20, 38)}
    assert set(number) == allowed
    assert len(one) == len(allowed)
    counts = np.unique(number, return_counts=True)[1]
    assert abs(counts / 40_000 - 1 / len(allowed)).max() < 5 * np.sqrt(1 / len(allowed) / 40_000)
    np.testing.assert_array_equal(drawn.weights, 1.0)


def test_even_one_tick_among_thousands_is_found():
    one = replay(capacity=4000)
    one.add(ticks(0, 2000, 2, inactive=[(t, r) for t in range(2000) for r in range(2) if (t, r) != (77, 1)]))
    assert len(one) == 1
    drawn = one.ring.gather(one._draw_alike(8, torch.Generator().manual_seed(1)), 1, GAMMA)
    assert set(drawn.observations["number"][:, 0]) == {1077.0}


def test_priorities_draw_as_the_paper_says():
    one = replay(rows=1, capacity=16, prioritised=True, priority_exponent=0.7, importance_exponent=0.5)
    one.add(ticks(0, 16))
    errors = np.linspace(-3, 3, 16)
    one.set_priorities(np.arange(16), errors)
    expected = (np.abs(errors) + 1e-6) ** 0.7
    expected /= expected.sum()
    drawn = one.sample(200_000, torch.Generator().manual_seed(3))
    share = np.bincount(drawn.index, minlength=16) / 200_000
    assert abs(share - expected).max() < 2e-4, "one draw from each equal slice: closer than chance alone"
    weights = (16 * expected[drawn.index]) ** -one.importance
    np.testing.assert_allclose(drawn.weights, weights / weights.max(), rtol=1e-5)
    assert 0.5 < one.importance < 0.5001


def test_what_is_new_gets_the_largest_priority_and_what_made_room_none():
    one = replay(rows=1, capacity=16, prioritised=True, priority_exponent=1.0)
    one.add(ticks(0, 16))
    one.set_priorities(np.arange(16), np.full(16, 7.0))
    one.add(ticks(16, 4))
    leaves = one.priorities.leaves
    assert leaves[[16, 0, 1, 2]] == pytest.approx(7.0)
    assert leaves[3] == 0.0, "the slot that shows what comes next"
    one.set_priorities(np.array([3]), np.array([5.0]))
    assert leaves[3] == 0.0, "a late word on what made room changes nothing"


@pytest.mark.parametrize("count", [1, 17, 5000])
def test_the_tree_draws_where_the_cumulative_sum_says(count):
    rng = np.random.default_rng(count)
    weights = rng.random(count) * (rng.random(count) < 0.5)
    weights[rng.integers(count)] = 2.0
    tree = Priorities(count, 1.0)
    tree.set(rng.permutation(count), 9.0)
    order = rng.permutation(count)
    tree.set(order, weights[order])
    uniform = rng.random(999)
    index, share = tree.draw(uniform)
    mass = (np.arange(999) + uniform) / 999 * weights.sum()
    np.testing.assert_array_equal(index, np.searchsorted(np.cumsum(weights), mass, side="right"))
    np.testing.assert_allclose(share, weights[index] / weights.sum(), rtol=1e-12)


@pytest.mark.parametrize("prioritised", [False, True])
def test_a_replay_that_was_kept_goes_on_as_if_it_had_never_stopped(prioritised):
    whole, again = (replay(prioritised=prioritised, n_step=2) for _ in range(2))
    for first in range(0, 33, 3):
        whole.add(ticks(first, 3, 2, truncated=[(14, 0), (31, 1)]))
        if prioritised and len(whole):
            places = whole.ring.places(whole.ring.oldest, first)
            whole.set_priorities(places, np.sin(np.arange(len(places))))
    again.restore(whole.state())
    for one in (whole, again):
        one.add(ticks(33, 3, 2))
    mine, its = (one.sample(64, torch.Generator().manual_seed(5)) for one in (whole, again))
    np.testing.assert_array_equal(mine.index, its.index)
    np.testing.assert_array_equal(mine.next_observations["frame"], its.next_observations["frame"])
    np.testing.assert_array_equal(mine.weights, its.weights)
    assert whole.importance == again.importance


def test_one_too_large_for_checkpoints_begins_anew_and_says_so():
    large, again = replay(keep_mib=0.0001), replay(keep_mib=0.0001)
    large.add(ticks(0, 20, 2))
    state = large.state()
    assert "ring" not in state
    again.restore(state)
    assert again.begins_anew
    assert again.collected == 40
    assert again.add(ticks(20, 4, 2)) is None, "it waits until enough is remembered again"


def test_one_larger_than_the_memory_allowed_is_refused_with_what_fits():
    spec = WorldSpec("car", 8, 1, {"FRONT": ArraySpec((120, 160), np.uint8)}, DiscreteActions(5))
    with pytest.raises(
        SettingError, match=r"replay.capacity=1000000 needs 19.0\d GiB \(20.4 kB a transition\)"
    ) as told:
        Replay(spec, ReplayConfig(capacity=1_000_000), 0.99)
    assert "replay.memory_gib allows 4 GiB" in str(told.value)
    fits = int(str(told.value).split("replay.capacity=")[2].split(",")[0])
    Replay(spec, ReplayConfig(capacity=fits), 0.99)


# ---- figures by hand -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("rows", "capacity", "n_step", "kept"), [(3, 10, 1, 4), (3, 3, 5, 6)])
def test_as_many_ticks_are_kept_as_hold_the_capacity_and_a_step_more_than_is_looked_ahead(rows, capacity, n_step, kept):
    one = replay(rows=rows, n_step=n_step, capacity=capacity)
    assert (one.ring.ticks, one.rows) == (kept, rows)


def test_the_weighing_out_grows_in_a_straight_line_to_one():
    one, found = replay(prioritised=True, importance_exponent=0.4, importance_steps=40), []
    for first in range(0, 40, 10):
        found.append(one.importance)
        one.add(ticks(first, 10, 2, inactive=[(1, 0), (1, 1)]))
    assert found == pytest.approx([0.4, 0.4 + 0.6 * 18 / 40, 0.4 + 0.6 * 38 / 40, 1.0])


def test_a_memory_that_is_full_is_learned_from_however_little_it_holds():
    one = Replay(world(2), ReplayConfig(capacity=10, learning_starts=1000), GAMMA)
    assert one.add(ticks(0, 4, 2)) is None
    assert one.add(ticks(4, 1, 2)) is one
    idle = Replay(world(1), ReplayConfig(capacity=4, learning_starts=1), GAMMA)
    assert idle.add(ticks(0, 4, inactive=[(tick, 0) for tick in range(4)])) is None
    assert idle.add(ticks(4, 1)) is idle, "one will do"


FORESEEN = {VALUE_TAKEN: ArraySpec((), np.float32), VALUE_BEST: ArraySpec((), np.float32)}


def foreseen(first, count, **ends):
    """Return ticks whose actor expects a half of what it takes and 10 * tick of the best."""
    batch = ticks(first, count, **ends)
    best = 10.0 * np.arange(first, first + count, dtype=np.float32)[:, None]
    batch.columns = {VALUE_TAKEN: np.full((count, 1), 0.5, np.float32), VALUE_BEST: best}
    return batch


def test_what_is_new_weighs_what_its_actor_got_wrong():
    """Paid tick + 1, and half of what is expected a tick later, less a half. An end expects nothing; of a cut, the
    value before it stands for the one behind. The newest tick waits for what will be expected after it."""
    config = ReplayConfig(capacity=16, learning_starts=1, prioritised=True, priority_exponent=1.0)
    one = Replay(world(1), config, GAMMA, 1, FORESEEN)
    one.add(foreseen(0, 6, terminated=[(1, 0)], truncated=[(2, 0)], inactive=[(3, 0)]))
    wrong = [1 + 5 - 0.5, 2 - 0.5, 3 + 10 - 0.5, None, 5 + 25 - 0.5]
    expected = [0.0 if error is None else error + 1e-6 for error in wrong]
    assert one.priorities.leaves[:7] == pytest.approx([*expected, 0.0, 0.0])
    assert len(one) == 4
    one.add(foreseen(6, 1))
    assert one.priorities.leaves[5:8] == pytest.approx([6 + 30 - 0.5 + 1e-6, 0.0, 0.0])
    assert len(one) == 5


def test_without_the_actors_word_the_newest_tick_is_drawn_at_once():
    one = replay(rows=1, capacity=16, prioritised=True)
    one.add(ticks(0, 6))
    assert len(one) == 6
    assert one.priorities.leaves[:8].tolist() == [1.0] * 6 + [0.0, 0.0]
    late = replay(rows=1, n_step=3, capacity=16, prioritised=True)
    late.add(ticks(0, 6))
    assert len(late) == 4
    assert late.priorities.leaves[:8].tolist() == [1.0] * 4 + [0.0] * 4
    late.add(ticks(6, 2))
    assert late.priorities.leaves[:8].tolist() == [1.0] * 6 + [0.0] * 2


def test_what_was_given_up_for_want_of_room_is_drawn_no_more():
    one = replay(rows=1, capacity=40, prioritised=True)  # room for two last observations
    one.add(ticks(0, 12, truncated=[(tick, 0) for tick in (1, 4, 7)]))
    assert np.flatnonzero(one.priorities.leaves == 0.0).tolist()[:2] == [1, 12]


def test_a_machine_smaller_than_what_is_allowed_says_so(monkeypatch):
    for here, told in ((2**18, "this machine has 0.0 GiB"), (None, "memory_gib allows 0.001 GiB")):
        monkeypatch.setattr(memory, "machine_bytes", lambda here=here: here)
        with pytest.raises(SettingError, match=told) as letter:
            Replay(world(2), ReplayConfig(capacity=60_000, memory_gib=0.001), GAMMA)
        assert ("larger --set" in str(letter.value)) == (here is None)
