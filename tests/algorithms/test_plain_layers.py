"""What a foreign model's file does not hold begins as our own networks of that preset begin."""

import numpy as np
import pytest
import torch
from tests.worlds.deepracer.files.tensorflow.policies import layers_for

from racecraft.algorithms.architecture import architecture_from
from racecraft.algorithms.networks import ActorCritic
from racecraft.algorithms.plain_layers import NoPlainLayersError, layers_of, policy_of
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.twin_critics import SoftActorCritic
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions
from racecraft.formats.policy_layers import DenseLayer, NetworkLayers, PolicyLayers, PolicyLayersError, SensorLayers
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME
from racecraft.worlds.deepracer.env.sensors import LIDAR, STEREO, car_sensors

SENSORS = [(CAMERA_NAME,), (STEREO,), (CAMERA_NAME, LIDAR)]


@pytest.fixture(params=["discrete", "continuous", "sac"])
def kind(request):
    return request.param


@pytest.mark.parametrize(("network", "sensors"), [("shallow", SENSORS[0]), ("tiny", SENSORS[1]), ("tiny", SENSORS[2])])
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


@pytest.mark.parametrize("sensors", SENSORS, ids=len)
def test_layers_of_a_policy_make_up_the_same_policy_again(kind, sensors):
    told, policy = layers_for(kind, "tiny", sensors)
    actions = DiscreteActions(5) if kind == "discrete" else ContinuousActions((-0.5, 0.5), (0.5, 2.0))
    again = policy_of(told, car_sensors(sensors).specs(160, 120), actions)
    known = {
        name: part.numpy()
        for name, part in policy.network.state_dict().items()
        if "critic" not in name or kind != "sac"
    }
    assert known.keys() <= again.weights.keys()
    for name, weights in known.items():
        np.testing.assert_array_equal(again.weights[name], weights, err_msg=name)
    assert again.spec.algorithm == ("sac" if kind == "sac" else "ppo")
    assert again.spec.network.get("probability_floor") == (None if kind == "sac" else 1e-8)
    assert again.spec.network.get("distribution") == (None if kind == "sac" else "gaussian")
    resumed_words = layers_of(again.spec, again.weights, sorted(sensors))
    assert [(one.name, one.shape, one.shrink) for one in resumed_words.network.sensors] == [
        (one.name, one.shape, one.shrink) for one in told.network.sensors
    ]
    assert [layer.stride for one in resumed_words.network.sensors for layer in one.convolutions] == [
        layer.stride for one in told.network.sensors for layer in one.convolutions
    ]


def test_a_frozen_sac_explores_by_e_to_the_minus_one():
    told, _ = layers_for("sac", "tiny", (CAMERA_NAME,))
    lone = PolicyLayers(told.kind, told.network)
    policy = policy_of(lone, car_sensors((CAMERA_NAME,)).specs(160, 120), ContinuousActions((-0.5, 0.5), (0.5, 2.0)))
    last = max(name for name in policy.weights if name.startswith("actor.") and name.endswith("weight"))
    head, bias = policy.weights[last], policy.weights[last.replace("weight", "bias")]
    np.testing.assert_array_equal(head[:2].T, told.network.head.kernel)
    assert not head[2:].any()
    assert bias[2:].tolist() == [-1.0, -1.0]


VECTOR = {"x": ArraySpec((3,), np.float32)}
TRUTH = {"truth": ArraySpec((2,), np.float32, privileged=True)}
NUMBERS = ContinuousActions((-1.0, -1.0), (1.0, 1.0))


def spec_of(algorithm="ppo", observations=VECTOR, actions=None, **more):
    told = {"trunk_units": [2], "separate_networks": True, "privileged_critic": False} | more.pop("network", {})
    return PolicySpec(algorithm, observations, actions or DiscreteActions(4), told, **more)


def dense(place, inputs, units):
    numbers = np.arange(inputs * units, dtype=np.float32).reshape(units, inputs)
    return {f"{place}.weight": numbers, f"{place}.bias": np.full(units, 0.5, np.float32)}


TWO_BODIES = {
    **dense("policy_body.trunk.0", 3, 2), **dense("policy_head", 2, 4),
    **dense("critic_body.trunk.0", 3, 2), **dense("value_head", 2, 1),
}  # fmt: skip


def test_a_dense_layer_is_turned_round():
    layers = layers_of(spec_of(), TWO_BODIES, ("LIDAR",))
    assert (layers.kind, layers.log_std, layers.log_std_head) == ("discrete", None, None)
    (sensor,) = layers.network.sensors
    assert (sensor.name, sensor.shape, sensor.convolutions, sensor.dense, sensor.shrink) == ("LIDAR", (3,), (), (), 1)
    (trunk,) = layers.network.trunk
    assert trunk.kernel.tolist() == [[0, 3], [1, 4], [2, 5]]
    assert trunk.bias.tolist() == [0.5, 0.5]
    assert layers.network.head.kernel.shape == (2, 4)
    assert layers.critic.head.kernel.shape == (2, 1)
    assert layers_of(spec_of(), TWO_BODIES).network.sensors[0].name == "x"  # ours, where nobody names AWS's


@pytest.mark.parametrize(
    ("spec", "is_told"),
    [
        (spec_of(), True),
        (spec_of(network={"separate_networks": False}), False),
        (spec_of(observations=VECTOR | TRUTH), True),
        (spec_of(observations=VECTOR | TRUTH, network={"privileged_critic": True}), False),
        (spec_of(network={"privileged_critic": True}), True),
    ],
)
def test_a_critic_is_told_where_it_sees_what_the_policy_sees(spec, is_told):
    assert (layers_of(spec, TWO_BODIES).critic is not None) == is_told


def test_of_two_streams_the_choices_alone_are_told():
    network = {"dueling": True, "trunk_units": [5, 2]}
    weights = dense("body.trunk.0", 3, 5) | dense("choices.0", 5, 2) | dense("choices.2", 2, 4)
    told = layers_of(spec_of("dqn", network=network), weights)
    assert [layer.kernel.shape for layer in told.network.trunk] == [(3, 5), (5, 2)]
    assert (told.kind, told.network.head.kernel.shape) == ("discrete", (2, 4))
    bare = layers_of(spec_of("apex", network={"dueling": True, "trunk_units": []}), dense("choices.0", 3, 4))
    assert (bare.network.trunk, bare.network.head.kernel.shape) == ((), (3, 4))
    one = layers_of(spec_of("dqn"), dense("body.trunk.0", 3, 2) | dense("choices.0", 2, 4))
    assert [layer.kernel.shape for layer in (*one.network.trunk, one.network.head)] == [(3, 2), (2, 4)]


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        (spec_of("alphazero"), "learned by alphazero; expected one of apex, bc, dqn, es, ppo, reinforce, sac"),
        (spec_of(stack_size=2), "network.stack_size=2"),
        (spec_of(network={"memory": "gru"}), "network.memory=gru"),
        (spec_of(network={"encoder": "mine:Own"}), "network.encoder=mine:Own"),
        (spec_of(network={"normalise": True}), "network.normalise=true"),
        (spec_of(network={"distribution": "squashed"}), "ppo.distribution=squashed"),
    ],
)
def test_what_no_cars_file_can_hold_is_refused(spec, said):
    with pytest.raises(NoPlainLayersError, match=said):
        layers_of(spec, TWO_BODIES)


@pytest.mark.parametrize(
    ("shape", "shrink"),
    [
        ((120, 160), 1), ((30, 40, 2), 4), ((60, 160), None), ((120, 7), None),
    ],
)  # fmt: skip
def test_pictures_are_the_cameras_or_squares_of_it(shape, shrink):
    spec = spec_of(observations={"eye": ArraySpec(shape, np.uint8)}, network={"separate_networks": False})
    weights = dense("policy_body.trunk.0", int(np.prod(shape)), 2) | dense("policy_head", 2, 4)
    if shrink is None:
        with pytest.raises(NoPlainLayersError, match=f"sees {shape[1]} x {shape[0]} px; expected 160 x 120"):
            layers_of(spec, weights)
    else:
        (sensor,) = layers_of(spec, weights).network.sensors
        assert (sensor.shape, sensor.shrink) == ((120, 160, *(shape[2:] or (1,))), shrink)


def network_of(*shapes, outputs=4):
    sensors = tuple(SensorLayers(f"s{number}", shape) for number, shape in enumerate(shapes))
    return NetworkLayers(sensors, (), DenseLayer(np.ones((2, outputs), np.float32), np.zeros(outputs, np.float32)))


SEEN = {"eye": ArraySpec((120, 160), np.uint8), "lidar": ArraySpec((8,), np.float32)}


@pytest.mark.parametrize(
    ("shapes", "seen", "said"),
    [
        (((120, 160, 1), (120, 160, 1)), {"a": SEEN["eye"], "b": SEEN["eye"]}, "more than one camera or LiDAR"),
        (((120, 160, 2),), {"eye": SEEN["eye"]}, r"sees s0 \(120, 160, 2\); expected eye \(120, 160\)"),
        (((9,),), {"lidar": SEEN["lidar"]}, r"sees s0 \(9,\); expected lidar \(8,\)"),
        (((120, 160, 1),), SEEN, "its network sees"),
    ],
)
def test_layers_that_see_another_world_are_refused(shapes, seen, said):
    with pytest.raises(PolicyLayersError, match=said):
        policy_of(PolicyLayers("discrete", network_of(*shapes)), seen | TRUTH, DiscreteActions(4))


@pytest.mark.parametrize(
    ("kind", "actions", "said"),
    [
        ("discrete", DiscreteActions(5), r"chooses among 4 \(discrete\); expected 5 actions of a list"),
        ("continuous", DiscreteActions(4), r"gives 4 numbers \(continuous\); expected 4 actions"),
        ("sac", NUMBERS, "gives 4.*expected 2 numbers"),
    ],
)
def test_layers_that_decide_something_else_are_refused(kind, actions, said):
    with pytest.raises(PolicyLayersError, match=said):
        policy_of(PolicyLayers(kind, network_of((8,))), {"lidar": SEEN["lidar"]}, actions)
