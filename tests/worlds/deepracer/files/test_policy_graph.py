"""A policy as a frozen graph: its nodes by name, what it answers, and what of a graph is read or refused."""

import numpy as np
import pytest
from tests.worlds.deepracer.files.tiny_policies import CAMERA, LIDAR, numbers_of, tiny_policy

from racecraft.formats.policy_layers import CONTINUOUS, DISCRETE, SAC, PolicyLayersError
from racecraft.worlds.deepracer.files.policy_graph import (
    as_commands,
    bare_lidars_in,
    graph_of,
    input_name,
    output_name,
    policy_in,
    policy_output_in,
    shrink_in,
    strides_in,
)
from racecraft.worlds.deepracer.files.tensorflow.arithmetic import GraphFunction
from racecraft.worlds.deepracer.files.tensorflow.graph import Graph, GraphError, Node, Shape

PPO, SCOPES = "main_level/agent/main/online/network_1", {SAC: "main_level/agent/policy/online/network_0"}
WAYS = {
    "choices": (DISCRETE, True, 1),
    "ranges": (CONTINUOUS, True, 1),
    "sac": (SAC, True, 1),
    "a bare LiDAR": (DISCRETE, False, 1),
    "smaller frames": (DISCRETE, True, 2),
}


def layer(numbers, one):
    return np.maximum(numbers @ one.kernel + one.bias, 0)


def answered(policy, picture, distances):
    """What the layers say of one moment, with nothing but NumPy."""
    eye, ear = policy.network.sensors
    first, second = eye.convolutions
    small = picture.reshape(120 // eye.shrink, eye.shrink, 160 // eye.shrink, eye.shrink).mean((1, 3)) / 255
    high, wide = first.kernel.shape[:2]
    places = [
        small[row * first.stride : row * first.stride + high, column * first.stride : column * first.stride + wide]
        for row in range(4)
        for column in range(5)
    ]
    seen = np.maximum(np.tensordot(places, first.kernel[:, :, 0], 2) + first.bias, 0)
    seen = np.maximum(seen @ second.kernel[0, 0] + second.bias, 0)
    seen = layer(seen.reshape(-1), eye.dense[0])
    heard = layer(distances, ear.dense[0]) if ear.dense else distances
    known = np.concatenate([seen, heard])
    for one in policy.network.trunk:
        known = layer(known, one)
    told = known @ policy.network.head.kernel + policy.network.head.bias
    return np.exp(told) / np.exp(told).sum() if policy.kind == DISCRETE else told


@pytest.mark.parametrize("way", WAYS)
def test_a_graph_answers_what_its_layers_say(way):
    kind, has_layers, shrink = WAYS[way]
    policy = tiny_policy(kind, has_layers, shrink)
    chance = np.random.default_rng(6)
    pictures, distances = chance.integers(0, 256, (3, 120, 160, 1)), chance.random((3, 8))
    graph = GraphFunction(graph_of(policy), output_name(kind))
    assert graph.inputs == {input_name(kind, CAMERA): (-1, 120, 160, 1), input_name(kind, LIDAR): (-1, 8)}
    told = graph({input_name(kind, CAMERA): pictures, input_name(kind, LIDAR): distances})
    wanted = [answered(policy, picture, known) for picture, known in zip(pictures, distances, strict=True)]
    np.testing.assert_allclose(told, wanted, rtol=2e-4, atol=2e-5)


@pytest.mark.parametrize("way", WAYS)
def test_a_graphs_layers_come_back(way):
    policy = tiny_policy(*WAYS[way])
    back = policy_in(graph_of(policy), "model.pb")
    assert (back.kind, numbers_of(back.network), back.critic) == (policy.kind, numbers_of(policy.network), None)


def dense(place, result, op="Relu"):
    return [f"{place}/kernel", f"{place}/kernel/read", f"{place}/bias", f"{place}/bias/read", f"{place}/MatMul",
            f"{place}/BiasAdd", (result, op)]  # fmt: skip


def bent(number):
    return f"BatchnormActivationDropout_{number}_activation"


def eye(scope, shrinks):
    nodes = [f"{scope}/truediv/y", (f"{scope}/truediv", "RealDiv"), *([(f"{scope}/shrink", "AvgPool")] * shrinks)]
    for number in (0, 2):
        place = f"{scope}/Conv2d_{number}"
        nodes += [*dense(place, f"{scope}/{bent(number + 1)}")[:4], (f"{place}/Conv2D", "Conv2D"),
                  f"{place}/BiasAdd", (f"{scope}/{bent(number + 1)}", "Relu")]  # fmt: skip
    return [*nodes, f"{scope}/Flatten/flatten/Reshape/shape", (f"{scope}/Flatten/flatten/Reshape", "Reshape"),
            *dense(f"{scope}/Dense_4", f"{scope}/{bent(5)}")]  # fmt: skip


@pytest.mark.parametrize(("kind", "shrink"), [(DISCRETE, 1), (DISCRETE, 2), (CONTINUOUS, 1), (SAC, 1)])
def test_nodes_bear_the_names_that_other_programs_look_up(kind, shrink):
    """Names of AWS's trainer; the last one is what a car's software asks."""
    scope = SCOPES.get(kind, PPO)
    middle, head = f"{scope}/middleware_fc_embedder", f"{scope}/{'sac_policy' if kind == SAC else 'ppo'}_head_0"
    last = "policy_fc" if kind == DISCRETE else "policy_mean"
    second = (
        dense(f"{head}/dense", f"{head}/dense/Relu")
        if kind == SAC
        else dense(f"{middle}/Dense_2", f"{middle}/{bent(3)}")
    )
    wanted = [
        (input_name(kind, CAMERA), "Placeholder"), *eye(f"{scope}/{CAMERA}", shrink > 1),
        (input_name(kind, LIDAR), "Placeholder"), *dense(f"{scope}/{LIDAR}/Dense_0", f"{scope}/{LIDAR}/{bent(1)}"),
        f"{scope}/merger/axis", (f"{scope}/merger", "ConcatV2"), *dense(f"{middle}/Dense_0", f"{middle}/{bent(1)}"),
        *second, *dense(f"{head}/{last}", f"{head}/policy", "Softmax" if kind == DISCRETE else "Identity"),
    ]  # fmt: skip
    nodes = graph_of(tiny_policy(kind, shrink=shrink)).nodes
    assert list(nodes) == [one if isinstance(one, str) else one[0] for one in wanted]
    assert {name: nodes[name].op for name, _ in (one for one in wanted if not isinstance(one, str))} == dict(
        one for one in wanted if not isinstance(one, str)
    )
    assert input_name(kind, CAMERA).endswith(f"/online/network_0/{CAMERA}/{CAMERA}")


def test_operations_say_what_tensorflow_wants_to_know_of_them():
    """As in AWS's own graphs: images channels last, no padding, no dilation, nothing transposed."""
    nodes = graph_of(tiny_policy(DISCRETE, shrink=2)).nodes
    of = {node.op: node.attributes for node in nodes.values()}
    assert of["AvgPool"]["ksize"] == of["AvgPool"]["strides"] == [1, 2, 2, 1]
    first = nodes[f"{PPO}/{CAMERA}/Conv2d_0/Conv2D"].attributes
    assert first["strides"] == [1, 15, 15, 1]
    assert (first["dilations"], first["use_cudnn_on_gpu"]) == ([1, 1, 1, 1], True)
    assert (of["MatMul"]["transpose_a"], of["MatMul"]["transpose_b"]) == (False, False)
    for op in ("AvgPool", "Conv2D", "BiasAdd"):
        assert of[op]["data_format"] == b"NHWC"
    assert of["ConcatV2"]["N"] == 2
    axis, shape = (
        nodes[f"{PPO}/{name}"].attributes for name in ("merger/axis", f"{CAMERA}/Flatten/flatten/Reshape/shape")
    )
    assert (axis["value"], axis["value"].dtype, axis["dtype"].code) == (-1, np.int32, 3)  # 3: TensorFlow's DT_INT32
    assert (shape["value"].tolist(), shape["value"].dtype) == ([-1, 60], np.int32)
    assert nodes[f"{PPO}/{CAMERA}/truediv/y"].attributes["dtype"].code == 1  # DT_FLOAT


def test_one_sensor_alone_is_not_merged():
    policy = tiny_policy(DISCRETE)
    network = type(policy.network)(policy.network.sensors[:1], policy.network.trunk, policy.network.head)
    nodes = graph_of(type(policy)(DISCRETE, network)).nodes
    assert not [name for name in nodes if "merger" in name]
    assert nodes[f"{PPO}/middleware_fc_embedder/Dense_0/MatMul"].inputs[0] == f"{PPO}/{CAMERA}/{bent(5)}"


def test_answers_become_likelihoods_or_numbers_from_minus_one_to_one():
    told = np.array([-3.0, -0.5, 0.25, 1.5])
    np.testing.assert_array_equal(as_commands(DISCRETE, told), told)
    assert as_commands(CONTINUOUS, told).tolist() == [-1.0, -0.5, 0.25, 1.0]
    np.testing.assert_allclose(as_commands(SAC, told), [-0.995055, -0.462117, 0.244919, 0.905148], atol=1e-6)


def convolution(name="c/Conv2D", strides=(1, 3, 3, 1), padding=b"VALID", inputs=("x", "k")):
    told = {} if strides is None else {"strides": list(strides)}
    return Node(name, "Conv2D", inputs, {**told, "padding": padding})


def test_a_stride_is_found_behind_what_only_hands_a_kernel_on():
    kernel, read, again = Node("k", "Const", (), {}), Node("r", "Identity", ("k",), {}), Node(
        "v", "ReadVariableOp", ("r",), {}
    )  # fmt: skip
    assert strides_in(Graph([kernel, read, again, convolution(inputs=("x", "v"))])) == {"k": 3}
    assert strides_in(Graph([convolution()])) == {"k": 3}, "the kernel may lie elsewhere"
    assert strides_in(Graph([convolution("a/target/c", (1, 2, 1, 1)), convolution("b", inputs=("x",))])) == {}
    assert strides_in(Graph([Node("p", "MaxPool", ("x", "k"), {})])) == {}


@pytest.mark.parametrize(
    "node", [convolution(strides=None), convolution(strides=(1, 3, 2, 1)), convolution(padding=b"SAME")]
)
def test_a_convolution_of_another_kind_is_refused(node):
    with pytest.raises(PolicyLayersError, match="c/Conv2D: has strides .* expected one stride and no padding"):
        strides_in(Graph([node]))


def test_a_graph_that_averages_no_pixels_shrinks_nothing():
    assert shrink_in(Graph([convolution()])) == 1
    assert shrink_in(graph_of(tiny_policy(DISCRETE, shrink=2))) == 2


def placeholder(name, *sizes):
    return Node(name, "Placeholder", (), {"shape": Shape(sizes)})


def test_of_placeholders_only_those_of_lidars_with_a_size_are_told():
    graph = Graph([
        placeholder("main/LIDAR/LIDAR", -1, 64), placeholder("main/SECTOR_LIDAR", -1, 1),
        placeholder("main/target/DISCRETIZED_SECTOR_LIDAR", -1, 8), placeholder("main/LEFT_CAMERA", -1, 8),
        placeholder("other/DISCRETIZED_SECTOR_LIDAR", -1, -1),
    ])  # fmt: skip
    assert bare_lidars_in(graph) == {"LIDAR": 64, "SECTOR_LIDAR": 1}
    assert bare_lidars_in(Graph([placeholder("LIDAR", -1, 8, 8)])) == {}


def test_the_node_that_is_asked_is_the_online_networks():
    names = ["main/target/ppo_head_0/policy", "main/online/ppo_head_0/policy_fc", "main/online/ppo_head_0/policy"]
    graph = Graph([Node(name, "Softmax", (), {}) for name in names])
    assert policy_output_in(graph, "model.pb") == names[2]
    with pytest.raises(GraphError, match=r"it has no node that ends in ppo_head_0/policy or sac_policy_head_0/policy"):
        policy_output_in(Graph([Node(names[0], "Softmax", (), {})]), "model.pb")
