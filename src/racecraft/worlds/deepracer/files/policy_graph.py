"""A car's policy as a frozen graph, node for node as the car's software looks them up. Begin with `graph_of`.

Source: facts: deepracer-systems.md B8 (names that other programs look up), and a `.meta` file of AWS's console.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.policy_layers import (
    DISCRETE,
    SAC,
    DenseLayer,
    PolicyLayers,
    PolicyLayersError,
    SensorLayers,
    flattened_size,
)
from racecraft.worlds.deepracer.files.policy_layers import (
    HEADS,
    INPUT_SCOPES,
    LAST_LAYERS,
    MIDDLEWARE,
    POLICY_SCOPES,
    head_layers,
)
from racecraft.worlds.deepracer.files.policy_weights import layers_from
from racecraft.worlds.deepracer.files.sensor_names import LIDARS
from racecraft.worlds.deepracer.files.tensorflow.arithmetic import VARIABLES, GraphFunction
from racecraft.worlds.deepracer.files.tensorflow.graph import Graph, GraphError, Node, NumberType, Shape, read_graph
from racecraft.worlds.deepracer.files.tensorflow.tensors import FLOAT, INT32

_FLOAT = NumberType(FLOAT)
_ACTIVATIONS = {"relu": "Relu", "tanh": "Tanh"}


def output_name(kind: str) -> str:
    """Return the node that a car's software asks.

    >>> output_name("discrete")
    'main_level/agent/main/online/network_1/ppo_head_0/policy'
    """
    return f"{POLICY_SCOPES[kind]}/{HEADS[kind]}/policy"


def input_name(kind: str, sensor: str) -> str:
    """Return the node that a car's software feeds with a sensor's numbers; images 0 to 255."""
    return f"{INPUT_SCOPES[kind]}/{sensor}/{sensor}"


def as_commands(kind: str, outputs: Array) -> Array:
    """Return what a graph answers as likelihoods of choices, or as numbers in [-1, 1] units.

    Two ranges are held to them, as a car's software does; those of SAC are bent by its tanh, which no graph holds.
    """
    if kind == DISCRETE:
        return outputs
    return np.asarray(np.tanh(outputs) if kind == SAC else np.clip(outputs, -1.0, 1.0))


def graph_of(policy: PolicyLayers) -> Graph:
    """Return a policy as a frozen graph."""
    return Graph(_nodes(policy))


def policy_in(graph: Graph, path: str | Path) -> PolicyLayers:
    """Return the layers of a frozen graph's policy.

    Args:
        graph: As `read_graph` gave it.
        path: Where it comes from, for the letter.

    Raises:
        GraphError: It is not frozen, or holds no policy of a car.
    """
    constants = graph.constants()
    if not any(name.endswith("/kernel") for name in constants):
        loose = next((node.name for node in graph.nodes.values() if node.op in VARIABLES), None)
        found = "it holds no weights" + (f" ({loose} is a variable)" if loose else "")
        raise GraphError(path, found, "a frozen graph", "Give the checkpoint beside it instead.")
    try:
        return layers_from(constants, strides_in(graph), shrink_in(graph), bare_lidars_in(graph))
    except PolicyLayersError as error:
        raise GraphError(path, str(error).split(";")[0], str(error).rpartition("expected ")[2].rstrip(".")) from error


def read_policy_graph(path: str | Path) -> tuple[PolicyLayers, GraphFunction]:
    """Return the layers of a frozen graph's policy, and the graph as the function it is.

    Raises:
        GraphError: No such file, damaged, or no policy of a car.
        GraphArithmeticError: It computes with what we do not know.
    """
    graph = read_graph(path)
    policy = policy_in(graph, path)
    return policy, GraphFunction(graph, policy_output_in(graph, path))


def policy_output_in(graph: Graph, path: str | Path) -> str:
    """Return the name of a graph's policy node."""
    ends = {f"/{head}/policy" for head in HEADS.values()}
    for name in graph.nodes:
        if "/target/" not in name and any(name.endswith(end) for end in ends):
            return name
    raise GraphError(
        path, "it has no node that ends in ppo_head_0/policy or sac_policy_head_0/policy", "a car's policy"
    )


def strides_in(graph: Graph) -> dict[str, int]:
    """Return the strides of a graph's convolutions by the names of their kernels.

    Raises:
        PolicyLayersError: One is padded, or steps otherwise down than across.
    """
    strides = {}
    for node in graph.nodes.values():
        if node.op != "Conv2D" or "/target/" in node.name or len(node.inputs) != 2:
            continue
        steps, padding = node.attributes.get("strides") or [], node.attributes.get("padding")
        if len(steps) != 4 or steps[1] != steps[2] or padding != b"VALID":
            raise PolicyLayersError(
                "{name}: has strides {steps} and padding {padding!r}; expected one stride and no padding.",
                name=node.name,
                steps=steps,
                padding=padding,
            )
        kernel = node.inputs[1]
        while kernel in graph.nodes and graph.nodes[kernel].op in ("Identity", "ReadVariableOp"):
            kernel = graph.nodes[kernel].inputs[0]
        strides[kernel] = int(steps[1])
    return strides


def shrink_in(graph: Graph) -> int:
    """Return how many pixels a graph averages to one before its first convolution; 1: none."""
    for node in graph.nodes.values():
        if node.op == "AvgPool":
            return int(node.attributes["ksize"][1])
    return 1


def bare_lidars_in(graph: Graph) -> dict[str, int]:
    """Return how many numbers each LiDAR of a graph tells, by name; one that has no layers shows nowhere else."""
    fed = (node for node in graph.nodes.values() if node.op == "Placeholder" and "/target/" not in node.name)
    shapes: dict[str, tuple[int, ...]] = {
        node.name.rpartition("/")[2]: getattr(node.attributes.get("shape"), "sizes", ()) for node in fed
    }
    return {name: sizes[1] for name, sizes in shapes.items() if name in LIDARS and len(sizes) == 2 and sizes[1] > 0}


def _nodes(policy: PolicyLayers) -> Iterator[Node]:
    kind, network = policy.kind, policy.network
    scope, bend = POLICY_SCOPES[kind], _ACTIVATIONS[network.activation]
    last = ""
    embedded = []
    for sensor in network.sensors:
        yield Node(
            input_name(kind, sensor.name),
            "Placeholder",
            (),
            {"dtype": _FLOAT, "shape": Shape((-1, *sensor.shape))},
        )
        nodes = list(_sensor(f"{scope}/{sensor.name}", input_name(kind, sensor.name), sensor, bend))
        yield from nodes
        embedded.append(nodes[-1].name if nodes else input_name(kind, sensor.name))
    last = embedded[0]
    if len(embedded) > 1:
        yield _const(f"{scope}/merger/axis", np.int32(-1))
        last = f"{scope}/merger"
        kinds = {"N": len(embedded), "T": _FLOAT, "Tidx": NumberType(INT32)}
        yield Node(last, "ConcatV2", (*embedded, f"{scope}/merger/axis"), kinds)
    middle, inner = head_layers(policy)
    for number, layer in enumerate(middle):
        bent = f"{scope}/{MIDDLEWARE}/BatchnormActivationDropout_{2 * number + 1}_activation"
        yield from _dense(f"{scope}/{MIDDLEWARE}/Dense_{2 * number}", last, layer, bend, bent)
        last = bent
    head = f"{scope}/{HEADS[kind]}"
    for layer in inner:
        yield from _dense(f"{head}/dense", last, layer, "Relu", f"{head}/dense/Relu")
        last = f"{head}/dense/Relu"
    op = "Softmax" if kind == DISCRETE else "Identity"
    yield from _dense(f"{head}/{LAST_LAYERS[kind]}", last, network.head, op, output_name(kind))


def _sensor(scope: str, fed: str, sensor: SensorLayers, bend: str) -> Iterator[Node]:
    last = fed
    if sensor.is_image:
        yield _const(f"{scope}/truediv/y", np.float32(255.0))
        last = f"{scope}/truediv"
        yield Node(last, "RealDiv", (fed, f"{scope}/truediv/y"), {"T": _FLOAT})
    if sensor.shrink > 1:
        size = [1, sensor.shrink, sensor.shrink, 1]
        yield Node(f"{scope}/shrink", "AvgPool", (last,), {"ksize": size, "strides": size, "padding": b"VALID",
                                                           "data_format": b"NHWC", "T": _FLOAT})  # fmt: skip
        last = f"{scope}/shrink"
    for number, layer in enumerate(sensor.convolutions):
        place, bent = f"{scope}/Conv2d_{2 * number}", f"{scope}/BatchnormActivationDropout_{2 * number + 1}_activation"
        yield from _weights(place, layer.kernel, layer.bias)
        steps = [1, layer.stride, layer.stride, 1]
        attributes = {
            "T": _FLOAT, "strides": steps, "padding": b"VALID", "data_format": b"NHWC", "dilations": [1, 1, 1, 1],
            "use_cudnn_on_gpu": True,
        }  # fmt: skip
        yield Node(f"{place}/Conv2D", "Conv2D", (last, f"{place}/kernel/read"), attributes)
        yield from _biased(place, f"{place}/Conv2D", bend, bent)
        last = bent
    if sensor.is_image:
        flat = f"{scope}/Flatten/flatten/Reshape"
        yield _const(f"{flat}/shape", np.array([-1, flattened_size(sensor)], np.int32))
        yield Node(flat, "Reshape", (last, f"{flat}/shape"), {"T": _FLOAT, "Tshape": NumberType(INT32)})
        last = flat
    for number, dense in enumerate(sensor.dense, len(sensor.convolutions)):
        bent = f"{scope}/BatchnormActivationDropout_{2 * number + 1}_activation"
        yield from _dense(f"{scope}/Dense_{2 * number}", last, dense, bend, bent)
        last = bent


def _dense(place: str, read: str, layer: DenseLayer, op: str, result: str) -> Iterator[Node]:
    yield from _weights(place, layer.kernel, layer.bias)
    attributes = {"T": _FLOAT, "transpose_a": False, "transpose_b": False}
    yield Node(f"{place}/MatMul", "MatMul", (read, f"{place}/kernel/read"), attributes)
    yield from _biased(place, f"{place}/MatMul", op, result)


def _weights(place: str, kernel: Array, bias: Array) -> Iterator[Node]:
    for name, array in (("kernel", kernel), ("bias", bias)):
        yield _const(f"{place}/{name}", np.asarray(array, np.float32))
        yield Node(f"{place}/{name}/read", "Identity", (f"{place}/{name}",), {"T": _FLOAT})


def _biased(place: str, product: str, op: str, result: str) -> Iterator[Node]:
    attributes = {"T": _FLOAT, "data_format": b"NHWC"}
    yield Node(f"{place}/BiasAdd", "BiasAdd", (product, f"{place}/bias/read"), attributes)
    yield Node(result, op, (f"{place}/BiasAdd",), {"T": _FLOAT})


def _const(name: str, value: Array | np.generic) -> Node:
    array = np.asarray(value)
    return Node(
        name, "Const", (), {"dtype": _FLOAT if array.dtype == np.float32 else NumberType(INT32), "value": array}
    )
