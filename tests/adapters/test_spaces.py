"""Our specs as Gymnasium spaces: every kind of action, bounds that a type can hold, and rows world by world."""

import numpy as np
import pytest
from gymnasium import spaces
from numpy.testing import assert_array_equal

from racecraft.adapters.spaces import action_space, box, flat_rows, observation_space, row_of
from racecraft.contract.world import (
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    GroupedActions,
    HybridActions,
    MultiDiscreteActions,
    WorldSpec,
)


def test_every_kind_of_action_is_a_space():
    numbers, counts = ContinuousActions((-2.0, 0.5), (3.0, 4.0)), MultiDiscreteActions((3, 5))
    low, high = np.float32([-2.0, 0.5]), np.float32([3.0, 4.0])
    assert action_space(numbers) == spaces.Box(low, high)
    assert action_space(DiscreteActions(7)) == spaces.Discrete(7)
    assert action_space(counts) == spaces.MultiDiscrete([3, 5])
    both = spaces.Box(np.float32([-2.0, 0.5, 0.0, 0.0]), np.float32([3.0, 4.0, 2.0, 4.0]))
    assert action_space(HybridActions(numbers, counts)) == both, "a choice of three is 0 to 2"


def test_actions_of_several_groups_are_a_row_of_numbers_without_bounds():
    assert action_space(GroupedActions(5)) == spaces.Box(-np.inf, np.inf, (5,), np.float32)


@pytest.mark.parametrize(
    ("part", "low", "high", "kind"),
    [
        (ArraySpec((2,), np.uint8), 0, 255, np.uint8),
        (ArraySpec((2,), np.uint8, 3, 7), 3, 7, np.uint8),
        (ArraySpec((2,), np.int8, -1000, 1000), -128, 127, np.int8),
        (ArraySpec((2,), np.int16, -5, 5), -5, 5, np.int16),
        (ArraySpec((2,), bool), 0, 1, np.int8),
        (ArraySpec((2,), np.float32), -np.inf, np.inf, np.float32),
        (ArraySpec((2,), np.float32, -1.5, 2.5), -1.5, 2.5, np.float32),
    ],
)
def test_bounds_are_held_within_what_a_type_can_hold(part, low, high, kind):
    assert box(part) == spaces.Box(low, high, (2,), kind)


def test_what_is_privileged_is_not_shown_and_one_array_alone_is_no_dictionary():
    seen = {
        "near": ArraySpec((3,), np.float32, 0, 1),
        "far": ArraySpec((2, 2), np.uint8),
        "map": ArraySpec((9,), np.float32, privileged=True),
    }
    two = WorldSpec("two", 2, 3, seen, DiscreteActions(2))
    assert observation_space(two) == spaces.Dict(near=spaces.Box(0, 1, (3,)), far=spaces.Box(0, 255, (2, 2), np.uint8))
    named = {name: np.arange(6 * np.prod(part.shape)).reshape(2, 3, *part.shape) for name, part in seen.items()}
    rows = flat_rows(two, named)
    assert list(rows) == ["near", "far"]
    assert_array_equal(rows["near"], np.arange(18).reshape(6, 3))
    assert_array_equal(row_of(rows, 4)["near"], named["near"][1, 1])
    assert_array_equal(row_of(rows, 4)["far"], [[16, 17], [18, 19]])
    rows["near"][0] = 99
    assert named["near"][0, 0, 0] == 0, "a copy"
    one = WorldSpec("one", 2, 3, {"far": seen["far"], "map": seen["map"]}, DiscreteActions(2))
    assert observation_space(one) == spaces.Box(0, 255, (2, 2), np.uint8)
    assert_array_equal(row_of(flat_rows(one, named), 5), [[20, 21], [22, 23]])
