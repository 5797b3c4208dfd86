"""The ONNX file for Unity: its layout name by name, and its actions beside the network's own."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.actor_policy import ActorPolicy
from racecraft.algorithms.distributions import GAUSSIAN, SQUASHED, distribution_for
from racecraft.algorithms.networks import ActorCritic, Architecture
from racecraft.algorithms.q_network import QNetwork, QPolicy
from racecraft.contract.errors import UserInputError
from racecraft.contract.world import ArraySpec
from racecraft.worlds.unity.env.actions import ActionTable
from racecraft.worlds.unity.env.behaviors import Behavior, Sensor, UnityActions
from racecraft.worlds.unity.export.unity_model import check_unity_model, to_wire, unity_model, write_unity_model

onnx = pytest.importorskip("onnx", reason="the extra racecraft[onnx] is not installed")
onnxruntime = pytest.importorskip("onnxruntime", reason="the extra racecraft[onnx] is not installed")

VECTOR = Sensor("sight", (5,), (5,))
CAMERA = Sensor("camera", (20, 24, 3), (3, 20, 24), compressed=True, layout="CHW")
GRID = Sensor("a grid", (16, 16, 2), (16, 16, 2))
ENTITIES = Sensor("entities", (4, 3), (4, 3), variable_length=True)


def make_policy(behavior, seed=0, numbers=GAUSSIAN, **row):
    observations = {sensor.name: ArraySpec(sensor.shape, sensor.dtype) for sensor in behavior.sensors}
    architecture = Architecture(**{"convolutions": ((4, 4, 2), (8, 3, 2)), "trunk_units": (16, 16), **row})
    actions = ActionTable(behavior.actions).spec
    network = ActorCritic(observations, actions, architecture, torch.Generator().manual_seed(seed))
    with torch.no_grad():  # a fresh head is almost indifferent; this one has opinions
        network.policy_head.weight.mul_(100)
    return ActorPolicy(network, distribution_for(actions, numbers=numbers))


def make_observations(behavior, rows, seed=1):
    rng = np.random.default_rng(seed)
    return {
        sensor.name: rng.integers(0, 256, (rows, *sensor.shape), np.uint8)
        if sensor.compressed
        else rng.random((rows, *sensor.shape), np.float32)
        for sensor in behavior.sensors
    }


def make_allowed(branches, rows, seed=2):
    rng = np.random.default_rng(seed)
    parts = []
    for size in branches:
        part = rng.random((rows, size)) < 0.6
        part[np.arange(rows), rng.integers(0, size, rows)] = True
        parts.append(part)
    return np.concatenate(parts, axis=1) if parts else None


ACTIONS = {
    "one branch": UnityActions(0, (3,)),
    "three branches": UnityActions(0, (3, 2, 4)),
    "numbers": UnityActions(2, ()),
    "hybrid": UnityActions(2, (3, 2)),
    "large branches": UnityActions(0, (40, 40)),
}
SENSORS = {
    "vector": (VECTOR,),
    "everything": (VECTOR, CAMERA, GRID, ENTITIES),
}


@pytest.mark.parametrize("sensors", SENSORS)
@pytest.mark.parametrize("actions", ACTIONS)
def test_the_model_acts_as_the_network_does(actions, sensors):
    behavior = Behavior("Agent?team=0", SENSORS[sensors], ACTIONS[actions])
    policy = make_policy(behavior, activation="tanh" if sensors == "vector" else "relu")
    model = unity_model(policy, behavior)
    allowed = make_allowed(behavior.actions.branches, 200)
    assert check_unity_model(model, policy, behavior, make_observations(behavior, 200), allowed) < 1e-5


def run(model, **feeds):
    session = onnxruntime.InferenceSession(model.SerializeToString(), providers=["CPUExecutionProvider"])
    return dict(zip([output.name for output in session.get_outputs()], session.run(None, feeds), strict=True))


@pytest.mark.parametrize("dueling", [False, True])
def test_worths_become_the_best_choice_drawn_or_not(dueling):
    behavior = Behavior("Agent?team=0", SENSORS["everything"], UnityActions(0, (5,)))
    observations = {sensor.name: ArraySpec(sensor.shape, sensor.dtype) for sensor in behavior.sensors}
    row = Architecture(convolutions=((4, 4, 2), (8, 3, 2)), trunk_units=(16, 16))
    network = QNetwork(observations, ActionTable(behavior.actions).spec, row, dueling, torch.Generator().manual_seed(3))
    with torch.no_grad():
        network.choices[-1].weight.mul_(100)
    policy = QPolicy(network)
    seen, allowed = make_observations(behavior, 200), make_allowed((5,), 200)
    model = unity_model(policy, behavior)
    assert check_unity_model(model, policy, behavior, seen, allowed) == 0.0
    best = policy.act(seen, allowed)
    assert len(set(best.tolist())) > 2
    assert (best != policy.act(seen)).any()
    feeds = {f"obs_{i}": to_wire(sensor, seen[sensor.name]) for i, sensor in enumerate(behavior.sensors)}
    told = run(model, **feeds, action_masks=allowed.astype(np.float32))
    assert (told["discrete_actions"][:, 0] == best).all()
    with pytest.raises(UserInputError, match="decides"):
        unity_model(policy, Behavior("Agent?team=0", SENSORS["everything"], UnityActions(0, (4,))))


def test_the_layout_is_ml_agents_own():
    behavior = Behavior("Agent", (VECTOR, CAMERA), UnityActions(2, (3, 2)))
    model = unity_model(make_policy(behavior), behavior)
    assert model.ir_version == 6
    assert [opset.version for opset in model.opset_import] == [9]
    shapes = {
        value.name: [part.dim_param or part.dim_value for part in value.type.tensor_type.shape.dim]
        for value in [*model.graph.input, *model.graph.output]
    }
    assert shapes == {
        "obs_0": ["batch", 5],
        "obs_1": ["batch", 3, 20, 24],
        "action_masks": ["batch", 5],
        "version_number": [1],
        "memory_size": [1],
        "continuous_actions": ["batch", 2],
        "deterministic_continuous_actions": ["batch", 2],
        "continuous_action_output_shape": [1],
        "discrete_actions": ["batch", 2],
        "deterministic_discrete_actions": ["batch", 2],
        "discrete_action_output_shape": [1, 2],
    }
    constants = {weight.name: onnx.numpy_helper.to_array(weight).tolist() for weight in model.graph.initializer}
    assert constants["version_number"] == [3.0]
    assert constants["memory_size"] == [0.0]
    assert constants["discrete_action_output_shape"] == [[3.0, 2.0]]
    assert constants["continuous_action_output_shape"] == [2.0]
    assert {node.op_type for node in model.graph.node}.isdisjoint({"Constant", "Identity", "Loop", "If"})


def test_without_discrete_actions_there_is_no_mask():
    behavior = Behavior("Agent", (VECTOR,), UnityActions(1, ()))
    model = unity_model(make_policy(behavior), behavior)
    assert [value.name for value in model.graph.input] == ["obs_0"]
    assert not any("discrete" in value.name for value in model.graph.output)


@pytest.mark.parametrize("actions", ["one branch", "three branches", "hybrid"])
def test_a_drawn_action_is_never_a_forbidden_one(actions):
    behavior = Behavior("Agent", (VECTOR,), ACTIONS[actions])
    branches = behavior.actions.branches
    allowed = make_allowed(branches, 500)
    told = run(
        unity_model(make_policy(behavior), behavior),
        obs_0=make_observations(behavior, 500)["sight"],
        action_masks=allowed.astype(np.float32),
    )
    starts = np.cumsum((0, *branches[:-1]))
    for name in ("discrete_actions", "deterministic_discrete_actions"):
        assert told[name].dtype == np.int64
        assert np.take_along_axis(allowed, starts + told[name], axis=1).all()


def test_drawn_numbers_scatter_around_the_mean_and_stay_in_bounds():
    behavior = Behavior("Agent", (VECTOR,), UnityActions(2, ()))
    policy = make_policy(behavior)
    with torch.no_grad():
        policy.network.policy_head.weight.zero_()
        policy.network.policy_head.bias.copy_(torch.tensor([0.5, -0.2]))
        policy.network.log_std.fill_(np.log(0.1))
    told = run(unity_model(policy, behavior), obs_0=np.zeros((20_000, 5), np.float32))
    np.testing.assert_allclose(told["deterministic_continuous_actions"][0], [0.5, -0.2], rtol=1e-6)
    np.testing.assert_allclose(told["continuous_actions"].mean(0), [0.5, -0.2], atol=0.005)
    np.testing.assert_allclose(told["continuous_actions"].std(0), 0.1, rtol=0.05)
    assert np.abs(told["continuous_actions"]).max() <= 1


def test_the_file_is_named_after_the_behavior_and_written_whole(tmp_path):
    behavior = Behavior("Basic?team=0", (VECTOR,), UnityActions(0, (3,)))
    path = write_unity_model(tmp_path / "out", make_policy(behavior), behavior)
    assert path == tmp_path / "out" / "Basic.onnx"
    assert [file.name for file in path.parent.iterdir()] == ["Basic.onnx"]
    onnx.checker.check_model(onnx.load(path), full_check=True)


def test_branches_are_drawn_independently_with_the_networks_probabilities():
    """20,000 draws of one observation: shares of pairs are products, within five standard errors."""
    behavior = Behavior("Agent", (VECTOR,), UnityActions(1, (3, 2)))
    policy = make_policy(behavior)
    seen = np.full((20_000, 5), 0.3, np.float32)
    with torch.no_grad():
        params = policy.network.policy({"sight": torch.from_numpy(seen[:1])})[0] * 1.0
    left, right = torch.softmax(params[1:4], 0).numpy(), torch.softmax(params[4:6], 0).numpy()
    expected = np.outer(left, right).ravel()
    drawn = run(unity_model(policy, behavior), obs_0=seen, action_masks=np.ones((20_000, 5), np.float32))
    pairs = drawn["discrete_actions"] @ [2, 1]
    shares = np.bincount(pairs, minlength=6) / 20_000
    assert (np.abs(shares - expected) < 5 * np.sqrt(expected * (1 - expected) / 20_000) + 1e-9).all()
    assert expected.max() < 0.9, "a choice that is never in doubt would prove nothing"


@pytest.mark.parametrize("actions", [UnityActions(2, ()), UnityActions(2, (3,))])
def test_numbers_that_the_policy_bends_by_a_tanh_are_bent_in_the_file_too(actions):
    behavior = Behavior("Agent", (VECTOR,), actions)
    bent = make_policy(behavior, numbers=SQUASHED)
    seen, allowed = make_observations(behavior, 50), make_allowed(actions.branches, 50)
    assert check_unity_model(unity_model(bent, behavior), bent, behavior, seen, allowed) < 1e-5
    assert check_unity_model(unity_model(make_policy(behavior), behavior), bent, behavior, seen, allowed) > 1e-3


def test_running_statistics_go_into_the_file():
    behavior = Behavior("Agent", (VECTOR, CAMERA), UnityActions(1, (3,)))
    policy = make_policy(behavior, normalise=True)
    seen, allowed = make_observations(behavior, 200), make_allowed((3,), 200)
    untold = unity_model(policy, behavior)
    policy.network.observe({name: torch.from_numpy(20.0 + 3.0 * rows) for name, rows in seen.items()})
    assert check_unity_model(unity_model(policy, behavior), policy, behavior, seen, allowed) < 1e-5
    assert check_unity_model(untold, policy, behavior, seen, allowed) > 1e-3


def test_a_policy_that_decides_something_else_is_refused():
    """As one from before, over the combinations of two branches."""
    policy = make_policy(Behavior("A", (VECTOR,), UnityActions(0, (6,))))
    with pytest.raises(UserInputError, match=r"obeys MultiDiscreteActions\(counts=\(2, 3\)\)"):
        unity_model(policy, Behavior("A", (VECTOR,), UnityActions(0, (2, 3))))


def test_a_policy_of_another_behavior_is_refused():
    behavior = Behavior("A", (VECTOR,), UnityActions(0, (3,)))
    other = Behavior("B", (ENTITIES,), UnityActions(0, (3,)))
    with pytest.raises(UserInputError, match="it was trained on"):
        unity_model(make_policy(behavior), other)


def test_a_check_that_meets_another_network_fails():
    behavior = Behavior("A", (VECTOR,), UnityActions(2, ()))
    model = unity_model(make_policy(behavior, seed=0), behavior)
    other = make_policy(behavior, seed=5)
    assert check_unity_model(model, other, behavior, make_observations(behavior, 50)) > 1e-3
