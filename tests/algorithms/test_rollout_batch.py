"""Rollouts as rows: any rows are taken out of one, and several stand side by side as one, by hand."""

import numpy as np
import pytest

from racecraft.algorithms.rollout_batch import RolloutBatch, concat_rows


def rollout(ticks, rows, finals=(), begin=0, mask=False, **more):
    """Return a rollout whose numbers count up from `begin` in the order of ticks and rows."""
    numbers = begin + np.arange(ticks * rows).reshape(ticks, rows)
    parts = {
        "observations": {"x": np.stack([numbers, -numbers], axis=-1).astype(np.float32)},
        "actions": (numbers % 7).astype(np.int64),
        "reward": numbers.astype(np.float32),
        "terminated": numbers % 2 == 0,
        "truncated": numbers % 3 == 0,
        "active": numbers % 4 != 0,
        "last_observations": {"x": begin + 100.0 + np.arange(rows * 2, dtype=np.float32).reshape(rows, 2)},
        "last_active": np.arange(rows) % 2 == 0,
        "columns": {"value": (10 * numbers).astype(np.float32)},
        "final_index": np.array(finals, np.int64),
        "final_observations": {"x": begin + 500.0 + np.array([[one, one] for one in finals], np.float32)}
        if finals
        else {},
    }
    if mask:
        parts |= {
            "action_mask": np.stack([numbers % 2 == 0, numbers % 2 == 1], axis=-1),
            "last_action_mask": np.stack([np.ones(rows, bool), np.zeros(rows, bool)], axis=-1),
        }
    return RolloutBatch(**(parts | more))


def test_chosen_rows_are_taken_out_of_everything():
    whole = rollout(3, 4, finals=(1, 4, 7, 10, 11), mask=True)
    part = whole.of_rows(np.array([0, 3]))
    assert part.shape == (3, 2)
    for name in ("actions", "reward", "terminated", "truncated", "active", "action_mask"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[:, [0, 3]], err_msg=name)
    np.testing.assert_array_equal(part.observations["x"], whole.observations["x"][:, [0, 3]])
    np.testing.assert_array_equal(part.columns["value"], whole.columns["value"][:, [0, 3]])
    np.testing.assert_array_equal(part.last_observations["x"], whole.last_observations["x"][[0, 3]])
    np.testing.assert_array_equal(part.last_active, whole.last_active[[0, 3]])
    np.testing.assert_array_equal(part.last_action_mask, whole.last_action_mask[[0, 3]])
    # Of (0, 1), (1, 0), (1, 3), (2, 2) and (2, 3) the second, third and last are of rows 0 and 3: now 2, 3 and 5.
    assert part.final_index.tolist() == [2, 3, 5]
    assert part.final_observations["x"][:, 0].tolist() == [504.0, 507.0, 511.0]
    assert whole.of_rows(np.array([2])).final_index.tolist() == [2]
    bare = rollout(3, 4).of_rows(np.array([1]))
    assert (bare.action_mask, bare.last_action_mask) == (None, None)


def test_rows_side_by_side_are_the_whole_they_were_taken_from():
    whole = rollout(3, 5, finals=(0, 4, 6, 8, 12), mask=True)
    again = concat_rows([whole.of_rows(np.array(rows)) for rows in ([0, 1], [2], [3, 4])])
    assert again.final_index.tolist() == [0, 4, 6, 8, 12]
    for name, value in vars(whole).items():
        told = getattr(again, name)
        if isinstance(value, dict):
            assert value.keys() == told.keys()
        pairs = [(value[key], told[key]) for key in value] if isinstance(value, dict) else [(value, told)]
        for mine, its in pairs:
            np.testing.assert_array_equal(mine, its, err_msg=name)
            assert mine.dtype == its.dtype, name


def test_rows_with_fewer_ticks_stand_still_at_the_end_and_may_do_anything():
    short, long = rollout(2, 1, finals=(1,), begin=1, mask=True), rollout(4, 2, finals=(3, 4), begin=20, mask=True)
    both = concat_rows([short, long])
    assert both.shape == (4, 3)
    assert both.reward[:, 0].tolist() == [1.0, 2.0, 0.0, 0.0]
    assert both.reward[:, 1].tolist() == [20.0, 22.0, 24.0, 26.0]
    assert both.active[:, 0].tolist() == [True, True, False, False]
    assert not both.terminated[2:, 0].any()
    assert both.action_mask[:, 0].tolist() == [[False, True], [True, False], [True, True], [True, True]]
    np.testing.assert_array_equal(both.action_mask[:, 1:], long.action_mask)
    # The short one's (1, 0) stays so; the long one's (1, 1) and (2, 0) are rows 2 and 1 of three now.
    assert both.final_index.tolist() == [3, 5, 7]
    assert both.final_observations["x"][:, 0].tolist() == [502.0, 523.0, 524.0]
    turned = concat_rows([long, short])
    np.testing.assert_array_equal(turned.action_mask[:, :2], long.action_mask)
    np.testing.assert_array_equal(turned.action_mask[:, 2], both.action_mask[:, 0])
    np.testing.assert_array_equal(turned.reward, both.reward[:, [1, 2, 0]])


@pytest.mark.parametrize("finals", [((), ()), ((), (3,)), ((1,), ())])
def test_those_without_a_cut_add_no_final_observation(finals):
    both = concat_rows([rollout(2, 1, finals[0]), rollout(2, 2, finals[1])])
    expected = {(): [], (3,): [5], (1,): [3]}[finals[0] or finals[1]]  # (1, 1) of two rows is (1, 2) of three
    assert both.final_index.tolist() == expected
    assert both.final_index.dtype == np.int64
    assert len(both.final_observations.get("x", ())) == len(expected)
    assert (both.action_mask, both.last_action_mask) == (None, None)


def test_side_by_side_are_copies():
    one = rollout(2, 1)
    both = concat_rows([one])
    both.reward[:] = 99.0
    both.last_observations["x"][:] = 99.0
    assert one.reward.ravel().tolist() == [0.0, 1.0]
    assert one.last_observations["x"].tolist() == [[100.0, 101.0]]
