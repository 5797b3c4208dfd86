"""What somebody showed, as tensors that fit a world."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.demonstrations import DemonstrationBatch, demonstration_tensors, read_demonstration_batch
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import SettingError
from racecraft.contract.world import (
    ArraySpec,
    DiscreteActions,
    WorldSpec,
)
from racecraft.formats.demonstrations import Demonstrations

SEEN = {"x": ArraySpec((2,), np.float32), "true": ArraySpec((1,), np.float32, privileged=True)}
SPEC = WorldSpec("toy", 2, 1, SEEN, DiscreteActions(3))


def recorded(observations=SEEN, actions=SPEC.actions, mask=None):
    told = PolicySpec("bc", observations, actions).as_dictionary()
    arrays = {name: np.arange(3 * np.prod(part.shape)).reshape(3, *part.shape) for name, part in observations.items()}
    arrays = {name: array.astype(observations[name].dtype) for name, array in arrays.items()}
    return Demonstrations(arrays, np.array([2, 0, 1]), np.zeros(3, np.float32), np.zeros(3, np.int32), told, mask)


def test_what_is_asked_for_becomes_tensors_and_rows_of_them_are_taken():
    mask = np.array([[True, False, True]] * 2 + [[False, True, True]])
    shown = demonstration_tensors(recorded(mask=mask), SPEC, ["x"], torch.device("cpu"), "bc.demonstrations")
    assert len(shown) == 3
    assert list(shown.observations) == ["x"]
    taken = shown.take(torch.tensor([2, 0]))
    assert taken.observations["x"].tolist() == [[4.0, 5.0], [0.0, 1.0]]
    assert (taken.actions.tolist(), taken.action_mask.tolist()) == ([1, 2], mask[[2, 0]].tolist())
    bare = demonstration_tensors(recorded(), SPEC, [], torch.device("cpu"), "bc.demonstrations")
    assert (bare.action_mask, bare.take(torch.tensor([1])).action_mask) == (None, None)
    assert isinstance(bare, DemonstrationBatch)


def test_other_actions_and_other_or_missing_observations_are_refused_with_both():
    def asked(shown):
        return demonstration_tensors(shown, SPEC, ["x"], torch.device("cpu"), "gail.demonstrations")

    with pytest.raises(SettingError, match=r"gail.demonstrations: the recorded actions are .*count=4.*count=3"):
        asked(recorded(actions=DiscreteActions(4)))
    other = {"x": ArraySpec((3,), np.float32)}, {"x": ArraySpec((2,), np.uint8)}, {"y": SEEN["x"]}
    for observations, found in zip(other, (r"shape=\(3,\)", "uint8", "not recorded"), strict=True):
        with pytest.raises(SettingError, match=f"the observation 'x' is .*{found}"):
            asked(recorded(observations))
    assert len(asked(recorded({"x": SEEN["x"]}))) == 3, "nothing privileged need be there"
    assert len(asked(recorded({**SEEN, "more": SEEN["x"]}))) == 3


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_observations_that_no_recorder_named_are_matched_by_order_or_by_shape(order):
    world = WorldSpec(
        "toy", 2, 1, {"rays": ArraySpec((2,), np.float32), "eye": ArraySpec((3,), np.float32)}, SPEC.actions
    )
    parts = [list(world.observations.values())[place] for place in order]
    there = recorded({f"obs_{number}": part for number, part in enumerate(parts)})
    shown = demonstration_tensors(there, world, ["rays", "eye"], torch.device("cpu"), "bc.demonstrations")
    assert shown.observations["eye"].tolist() == there.observations[f"obs_{order.index(1)}"].tolist()
    twins = WorldSpec("toy", 2, 1, {"left": SEEN["x"], "right": SEEN["x"]}, SPEC.actions)
    alike = recorded({"obs_0": SEEN["x"], "obs_1": SEEN["x"]})
    assert set(demonstration_tensors(alike, twins, ["left", "right"], torch.device("cpu"), "bc").observations) == {
        "left",
        "right",
    }
    with pytest.raises(SettingError, match="not recorded"):
        demonstration_tensors(recorded({"obs_0": SEEN["x"]}), world, ["rays"], torch.device("cpu"), "bc.demonstrations")


def test_a_folder_without_demonstrations_is_refused(tmp_path):
    with pytest.raises(SettingError, match="holds no demonstrations; expected files that end in .demo"):
        read_demonstration_batch(tmp_path)
