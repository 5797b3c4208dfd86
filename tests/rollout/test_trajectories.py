"""Where a rollout lies: a row for every tick, one more of what is seen, and last observations of those cut."""

import numpy as np
import pytest

from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.rollout.trajectories import Trajectories, copy_observations

SEEN = {"frame": ArraySpec((2, 3), np.uint8), "speed": ArraySpec((1,), np.float32)}
COLUMNS = {"value": ArraySpec((), np.float32), "logits": ArraySpec((3,), np.float64)}


def storage(ticks=4, mask=True):
    return Trajectories(WorldSpec("two by two", 2, 2, SEEN, DiscreteActions(3), has_action_mask=mask), ticks, COLUMNS)


def shapes(kept):
    named = {**kept.observations, **kept.columns, **{name: getattr(kept, name) for name in ARRAYS}}
    return {name: (array.shape, array.dtype) for name, array in named.items()}


ARRAYS = ("active", "action_mask", "actions", "reward", "terminated", "truncated", "learn")


@pytest.mark.parametrize("grown", [False, True])
def test_there_is_a_row_more_of_what_is_seen_than_of_what_a_tick_brings(grown):
    kept = storage(4 if not grown else 2)
    if grown:
        kept.grow(4)
    assert (kept.ticks, len(kept.views)) == (4, 5)
    assert shapes(kept) == {
        "frame": ((5, 2, 2, 2, 3), np.uint8), "speed": ((5, 2, 2, 1), np.float32),
        "active": ((5, 2, 2), bool), "action_mask": ((5, 2, 2, 3), bool),
        "actions": ((4, 2, 2), np.int64), "reward": ((4, 2, 2), np.float32),
        "terminated": ((4, 2, 2), bool), "truncated": ((4, 2, 2), bool), "learn": ((4, 2, 2), bool),
        "value": ((4, 2, 2), np.float32), "logits": ((4, 2, 2, 3), np.float64),
    }  # fmt: skip


def filled(ticks=4):
    kept, rng = storage(ticks), np.random.default_rng(0)
    for array in [*kept.observations.values(), *kept.columns.values(), *(getattr(kept, name) for name in ARRAYS)]:
        array[:] = rng.integers(0, 2 if array.dtype == bool else 100, array.shape)
    return kept


def test_a_batch_lays_worlds_and_agents_side_by_side():
    kept = filled()
    batch = kept.batch(3)
    assert batch.shape == (3, 4)
    for n in range(2):
        for m in range(2):
            row = 2 * n + m
            for name in SEEN:
                np.testing.assert_array_equal(batch.observations[name][:, row], kept.observations[name][:3, n, m])
                np.testing.assert_array_equal(batch.last_observations[name][row], kept.observations[name][3, n, m])
            for name in COLUMNS:
                np.testing.assert_array_equal(batch.columns[name][:, row], kept.columns[name][:3, n, m])
            for name in ("actions", "reward", "terminated", "truncated", "action_mask"):
                np.testing.assert_array_equal(getattr(batch, name)[:, row], getattr(kept, name)[:3, n, m], name)
            assert (batch.active[:, row] == (kept.active[:3, n, m] & kept.learn[:3, n, m])).all()
            assert batch.last_active[row] == kept.active[3, n, m]
            assert (batch.last_action_mask[row] == kept.action_mask[3, n, m]).all()
    assert batch.final_index.tolist() == []
    assert batch.final_index.dtype == np.int64
    assert batch.final_observations == {}


def test_last_observations_are_kept_of_those_cut_alone_and_told_in_order():
    """Agent 1 of world 0 is cut in tick 1, agent 0 of world 1 in ticks 1 and 3; who ends for good leaves none."""
    kept = storage()
    for t, cut, ended in ((0, [], [(0, 0)]), (1, [(0, 1), (1, 0)], [(1, 1)]), (3, [(1, 0), (0, 0)], [(0, 0)])):
        then = kept.views[t + 1]
        for place in cut:
            then.truncated[place] = True
        for place in ended:
            then.terminated[place] = True
        then.final_observations["speed"][..., 0] = 10 * t + np.arange(4).reshape(2, 2)
        then.final_observations["frame"][:] = t
        kept.store_final_observations(t, then)
    batch = kept.batch(4)
    assert batch.final_index.tolist() == [4 + 1, 4 + 2, 3 * 4 + 2]
    assert batch.final_observations["speed"].tolist() == [[11], [12], [32]]
    assert batch.final_observations["frame"].shape == (3, 2, 3)
    kept.begin()
    assert kept.batch(4).final_observations == {}


def test_what_a_world_without_a_mask_shows_is_copied_without_one():
    one, other = storage(mask=False).views[0], storage().views[0]
    one.observations["speed"][:] = 3.0
    one.active[:] = False
    other.action_mask[:] = False
    copy_observations(one, other)
    assert (other.observations["speed"] == 3.0).all()
    assert not other.active.any()
    assert not other.action_mask.any()
