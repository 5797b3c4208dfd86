"""What a foreign model's file does not hold begins as our own networks of that preset begin."""

import numpy as np
import pytest
import torch
from tests.formats.tensorflow.policies import layers_for

from racecraft.algorithms.architecture import architecture_from
from racecraft.algorithms.networks import ActorCritic
from racecraft.algorithms.plain_layers import policy_of
from racecraft.algorithms.twin_critics import SoftActorCritic
from racecraft.contract.world import ContinuousActions, DiscreteActions
from racecraft.envs.deepracer.promise import CAMERA_NAME
from racecraft.envs.deepracer.sensors import LIDAR, STEREO, car_sensors
from racecraft.formats.aws.policy_layers import PolicyLayers

SENSORS = [(CAMERA_NAME,), (STEREO,), (CAMERA_NAME, LIDAR)]


@pytest.fixture(params=["discrete", "continuous", "sac"])
def kind(request):
    return request.param


@pytest.mark.parametrize("sensors", SENSORS, ids=len)
@pytest.mark.parametrize("network", ["tiny", "shallow"])
def test_begun_weights_are_named_shaped_and_spread_as_torch_begins_them(kind, network, sensors):
    told, _ = layers_for(kind, network, sensors)
    lone = PolicyLayers(told.kind, told.network)  # as in a frozen graph
    actions = DiscreteActions(5) if kind == "discrete" else ContinuousActions((-0.5, 0.5), (0.5, 2.0))
    policy = policy_of(lone, car_sensors(sensors).specs(160, 120), actions)
    made = (SoftActorCritic if kind == "sac" else ActorCritic)(
        policy.spec.observations, actions, architecture_from(policy.spec.network), torch.Generator().manual_seed(1)
    )
    expected = made.state_dict()
    assert {name: array.shape for name, array in policy.weights.items()} == {
        name: tuple(part.shape) for name, part in expected.items()
    }
    begun = [name for name in expected if name.startswith(("critic", "value_head", "log_std"))]
    assert len(begun) > 4
    for name in begun:
        ours, theirs = np.asarray(policy.weights[name]), expected[name].numpy()
        assert ours.dtype == np.float32
        if name == "value_head.weight":
            np.testing.assert_allclose(np.linalg.norm(ours, axis=1), np.linalg.norm(theirs, axis=1), rtol=1e-5)
        elif ours.ndim < 2 or "biases" in name:
            np.testing.assert_array_equal(ours, theirs)
        elif ours.size > 1000:
            assert abs(ours).max() == pytest.approx(abs(theirs).max(), rel=0.02)
            assert ours.std() == pytest.approx(theirs.std(), rel=0.1)
            assert ours.mean() == pytest.approx(0.0, abs=0.1 * float(ours.std()))


def test_what_a_file_does_not_tell_is_said(kind):
    told, _ = layers_for(kind, "tiny", (CAMERA_NAME,))
    actions = DiscreteActions(5) if kind == "discrete" else ContinuousActions((-0.5, 0.5), (0.5, 2.0))
    seen = car_sensors((CAMERA_NAME,)).specs(160, 120)
    notes = policy_of(PolicyLayers(told.kind, told.network), seen, actions).notes
    assert any("how widely it explores begins anew" in note for note in notes) == (kind != "discrete")
    assert any("critic begins anew" in note or "critics begin anew" in note for note in notes)
