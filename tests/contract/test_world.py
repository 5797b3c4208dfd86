"""Shapes that worlds promise: of actions, of masks and of the arrays they write into."""

import numpy as np
import pytest

from racecraft.contract.world import (
    AgentGroup,
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    GroupedActions,
    HybridActions,
    MultiDiscreteActions,
    WorldSpec,
    allocate,
    mask_width,
)

NUMBERS = ContinuousActions((-1.0, 0.0), (1.0, 2.0))
SEEN = {"x": ArraySpec((4,), np.uint8), "y": ArraySpec((), np.float32)}


@pytest.mark.parametrize(
    ("actions", "shape", "dtype", "width"),
    [
        (DiscreteActions(5), (), np.int64, 5),
        (MultiDiscreteActions((3, 2)), (2,), np.int64, 5),
        (NUMBERS, (2,), np.float32, 0),
        (HybridActions(NUMBERS, MultiDiscreteActions((3, 2, 4))), (5,), np.float32, 9),
    ],
)
def test_every_kind_of_action_has_its_shape_type_and_columns_of_a_mask(actions, shape, dtype, width):
    assert (actions.shape, actions.dtype) == (shape, dtype)
    assert mask_width(AgentGroup({}, actions)) == mask_width(WorldSpec("toy", 1, 1, SEEN, actions)) == width


def test_a_mask_of_several_groups_is_as_wide_as_the_widest_that_has_one():
    groups = {
        "few": AgentGroup({}, DiscreteActions(3), has_action_mask=True),
        "some": AgentGroup({}, MultiDiscreteActions((2, 2)), has_action_mask=True),
        "many": AgentGroup({}, DiscreteActions(9)),
    }
    spec = WorldSpec("groups", 2, 3, SEEN, GroupedActions(2), True, groups)
    assert (mask_width(spec), spec.actions.shape, spec.actions.dtype) == (4, (2,), np.float32)
    assert allocate(spec).action_mask.shape == (2, 3, 4)


def test_buffers_are_of_a_worlds_shapes_where_all_is_nought_and_everything_allowed():
    buffers = allocate(WorldSpec("toy", 2, 3, SEEN, DiscreteActions(5), has_action_mask=True))
    for named in (buffers.observations, buffers.final_observations):
        assert {name: (part.shape, part.dtype) for name, part in named.items()} == {
            "x": ((2, 3, 4), np.uint8), "y": ((2, 3), np.float32),
        }  # fmt: skip
        assert not any(part.any() for part in named.values())
    assert buffers.observations["x"] is not buffers.final_observations["x"]
    assert (buffers.reward.dtype, buffers.reward.any(), buffers.reward.shape) == (np.float32, False, (2, 3))
    assert not (buffers.terminated | buffers.truncated).any()
    assert buffers.active.all()
    assert buffers.action_mask.all()
    assert buffers.action_mask.shape == (2, 3, 5)
    buffers.terminated[0, 1], buffers.truncated[1, 2] = True, True
    assert np.argwhere(buffers.ended).tolist() == [[0, 1], [1, 2]]


def test_numbers_cannot_be_masked():
    with pytest.raises(ValueError, match="toy: an action mask needs choices to mask"):
        allocate(WorldSpec("toy", 1, 1, SEEN, NUMBERS, has_action_mask=True))
    both = HybridActions(NUMBERS, MultiDiscreteActions((3,)))
    assert allocate(WorldSpec("toy", 1, 1, SEEN, both, has_action_mask=True)).action_mask.shape == (1, 1, 3)
