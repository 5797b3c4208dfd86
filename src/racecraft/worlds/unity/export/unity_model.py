"""A trained policy as the ONNX file that a Unity scene loads.

Begin at `unity_model`, which builds the graph, and `check_unity_model`, which runs it beside the network. The layout is
ML-Agents' own, model version 3 (facts: unity-ml-agents, "Trained policy -> Unity"; checked there against a file that
ML-Agents trained):

    in    obs_0, obs_1 …                  float [batch, *shape], one a sensor in wire order; pictures NCHW in [0, 1]
    in    action_masks                    float [batch, sum of branches], 1 = allowed; with discrete actions only
    out   version_number, memory_size     float [1], constants: 3 and 0
    out   discrete_actions                int64 [batch, branches], drawn inside the graph; of worths the best
    out   deterministic_discrete_actions  int64 [batch, branches], the likeliest
    out   discrete_action_output_shape    float [1, branches], constant: the branch sizes
    out   continuous_actions, deterministic_continuous_actions    float [batch, numbers] in [-1, 1]
    out   continuous_action_output_shape  float [1], constant: how many numbers

Opset 9 and one file, because that is what every version of Unity's importers reads. A constant is an initialiser whose
name *is* the output: some importers look constants up by name, others run the model, and this serves both. The graph is
written with `onnx.helper` and not traced, so that nothing else stands in it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from racecraft.algorithms.actor_policy import ActorPolicy
from racecraft.algorithms.distributions import LOG_STD_RANGE, Distribution, Hybrid, SquashedGaussian
from racecraft.algorithms.networks import MAX_DEVIATIONS, Encoder, FlattenChannelsLast, Image, Vector
from racecraft.algorithms.q_network import QPolicy
from racecraft.algorithms.sac_policy import SacPolicy
from racecraft.algorithms.twin_critics import LOG_STD_RANGE as SAC_LOG_STD_RANGE
from racecraft.contract.errors import MissingExtraError, UserInputError
from racecraft.contract.world import Array, DiscreteActions
from racecraft.formats.atomic import write_atomic
from racecraft.worlds.unity.env.actions import ActionTable
from racecraft.worlds.unity.env.behaviors import Behavior, Sensor

UnityPolicy = ActorPolicy | SacPolicy | QPolicy
"""What there is a graph for: an actor network that tells what it draws from, or one that tells choices' worths."""
OPSET = 9
IR_VERSION = 6
MODEL_VERSION = 3.0
FORBIDDEN_PENALTY = 1e8
"""What is taken from the score of a forbidden action, as ML-Agents does."""


def write_unity_model(path: str | Path, policy: UnityPolicy, behavior: Behavior) -> Path:
    """Write `<behavior>.onnx` (or the file that `path` names) in one move and return where it lies.

    Args:
        path: A folder, or a file that ends in `.onnx`.
        policy: Whose observations carry the names of the behavior's sensors.
        behavior: What the agent sees and does.

    Raises:
        UserInputError: The policy was not made for this behavior.
        MissingExtraError: onnx is not installed.
    """
    target = Path(path)
    if target.suffix != ".onnx":
        target = target / f"{behavior.base_name}.onnx"
    model = unity_model(policy, behavior)
    target.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(target, model.SerializeToString())
    return target


def unity_model(policy: UnityPolicy, behavior: Behavior) -> Any:
    """Return the policy as an `onnx.ModelProto`, checked by the ONNX checker."""
    onnx, body = _onnx(), _body_of(policy)
    if not isinstance(body, Encoder):
        raise UserInputError(
            "the policy's network is one of your own (network.encoder); expected one of the built-in layers, which are "
            "all that is known in ONNX here."
        )
    _require_made_for(behavior, policy)
    continuous, branches = behavior.actions.continuous, behavior.actions.branches
    graph = _Graph(onnx)
    inputs = {sensor.name: graph.input(f"obs_{i}", _wire_shape(sensor)) for i, sensor in enumerate(behavior.sensors)}
    masks = graph.input("action_masks", (sum(branches),)) if branches else ""
    features = graph.body(body, inputs)

    graph.constant_output("version_number", [MODEL_VERSION])
    graph.constant_output("memory_size", [0.0])
    if isinstance(policy, SacPolicy):
        _add_soft_numbers(graph, continuous, graph.layers(policy.network.actor, features))
        return graph.finish(behavior.base_name)
    if isinstance(policy, QPolicy):  # what a moment is worth is the same for every choice: it changes none
        _add_best(graph, branches, graph.layers(policy.network.choices, features), masks)
        return graph.finish(behavior.base_name)
    params = graph.dense(policy.network.policy_head, features)
    means, logits = params, params
    if continuous and branches:
        means = graph.columns(params, 0, continuous)
        logits = graph.columns(params, continuous, continuous + sum(branches))
    if continuous:
        _add_numbers(graph, continuous, means, policy)
    if branches:
        _add_choices(graph, branches, logits, masks)
    return graph.finish(behavior.base_name)


def check_unity_model(
    model: Any,
    policy: UnityPolicy,
    behavior: Behavior,
    observations: Mapping[str, Array],
    allowed: Array | None = None,
) -> float:
    """Run the model in onnxruntime beside the policy and return the largest difference of its greedy actions.

    Args:
        model: What `unity_model` returned.
        policy: What it was made from.
        behavior: What the agent sees and does.
        observations: By sensor name, (R, *sensor shape), as the policy reads them.
        allowed: bool (R, sum of branches), or None where everything is.

    Returns:
        The largest difference over all rows and actions; a choice that differs counts as its difference in number.
    """
    branches = behavior.actions.branches
    outputs = run_unity_model(model.SerializeToString(), behavior, observations, allowed)

    seen = {name: np.ascontiguousarray(values) for name, values in observations.items()}
    choice = ActionTable(behavior.actions).choice(policy.act(seen, allowed if branches else None))
    away = [0.0]
    if branches:
        away.append(
            float(np.abs(outputs["deterministic_discrete_actions"] - np.asarray(choice.discrete)).max(initial=0))
        )
    if behavior.actions.continuous:
        away.append(float(np.abs(outputs["deterministic_continuous_actions"] - choice.continuous).max(initial=0)))
    return max(away)


def run_unity_model(
    model: bytes | str, behavior: Behavior, observations: Mapping[str, Array], allowed: Array | None = None
) -> dict[str, Array]:
    """Return what a model gives for R rows, by the names of its outputs.

    Args:
        model: Its bytes, or its file.
        behavior: What the agent sees and does.
        observations: By sensor name, (R, *sensor shape), as the policy reads them.
        allowed: bool (R, sum of branches), or None where everything is.

    Raises:
        MissingExtraError: onnxruntime is not installed.
    """
    try:
        import onnxruntime
    except ImportError as cause:
        raise _missing("onnxruntime") from cause
    feeds = {f"obs_{i}": to_wire(sensor, observations[sensor.name]) for i, sensor in enumerate(behavior.sensors)}
    if branches := behavior.actions.branches:
        rows = len(next(iter(observations.values())))
        free = np.ones((rows, sum(branches)), bool)
        feeds["action_masks"] = (free if allowed is None else allowed).astype(np.float32)
    session = onnxruntime.InferenceSession(model, providers=["CPUExecutionProvider"])
    names = [output.name for output in session.get_outputs()]
    return dict(zip(names, session.run(None, feeds), strict=True))


def to_wire(sensor: Sensor, values: Array) -> Array:
    """Return an observation (R, *shape) as Unity feeds it to a model: float32, pictures (R, C, H, W) in [0, 1]."""
    numbers = values.astype(np.float32)
    if sensor.compressed:
        numbers = numbers / np.float32(255)
    return np.ascontiguousarray(numbers.transpose(0, 3, 1, 2)) if sensor.is_picture else numbers


def _body_of(policy: UnityPolicy) -> nn.Module:
    """Return the network from observations to features."""
    return policy.network.policy_body if isinstance(policy, ActorPolicy) else policy.encoder


def _require_made_for(behavior: Behavior, policy: UnityPolicy) -> None:
    reads = (policy.network.policy_body if isinstance(policy, ActorPolicy) else policy.encoder).names
    if sorted(reads) != sorted(sensor.name for sensor in behavior.sensors):
        raise UserInputError(
            "the policy reads {reads}; behavior '{name}' shows "
            "{sensors}. Export it with the behavior it was trained on.",
            reads=", ".join(reads),
            name=behavior.name,
            sensors=", ".join(sensor.name for sensor in behavior.sensors),
        )
    if isinstance(policy, QPolicy):
        decides: Any = DiscreteActions(policy.network.count)
    else:
        decides = (policy.kind if isinstance(policy, SacPolicy) else policy.distribution).spec
    if decides != (wanted := ActionTable(behavior.actions).spec):
        raise UserInputError(
            "the policy decides {decides}; behavior '{name}' obeys {wanted}. Export it with the behavior it "
            "was trained on.",
            decides=decides,
            name=behavior.name,
            wanted=wanted,
        )


def _add_choices(graph: _Graph, branches: Sequence[int], logits: str, masks: str) -> None:
    """One choice in each branch, drawn independently of the others', and the likeliest of each."""
    drawn, argmax_action, at = [], [], 0
    for size in branches:
        scores, allowed = logits, masks
        if len(branches) > 1:
            scores, allowed = graph.columns(logits, at, at + size), graph.columns(masks, at, at + size)
        scores = graph.masked(scores, allowed)
        likely = graph.node("LogSoftmax", scores, axis=1)
        drawn.append(graph.node("Multinomial", likely, dtype=graph.INT64, sample_size=1))
        argmax_action.append(graph.node("ArgMax", scores, axis=1, keepdims=1))
        at += size
    for name, parts in (("discrete_actions", drawn), ("deterministic_discrete_actions", argmax_action)):
        chosen = graph.node("Concat", *parts, axis=1) if len(parts) > 1 else parts[0]
        graph.output(name, chosen, len(branches), graph.INT64)
    graph.constant_output("discrete_action_output_shape", [[float(size) for size in branches]])


def _add_best(graph: _Graph, branches: Sequence[int], worths: str, masks: str) -> None:
    """The one choice that is worth most, also where Unity asks for a drawn one: nothing is drawn from worths."""
    scores = graph.masked(worths, masks)
    for name in ("discrete_actions", "deterministic_discrete_actions"):
        graph.output(name, graph.node("ArgMax", scores, axis=1, keepdims=1), len(branches), graph.INT64)
    graph.constant_output("discrete_action_output_shape", [[float(size) for size in branches]])


def _add_soft_numbers(graph: _Graph, continuous: int, params: str) -> None:
    """Numbers bent into [-1, 1], each with a spread that hangs on what is seen: once drawn, and once their middle."""
    means = graph.columns(params, 0, continuous)
    low, high = SAC_LOG_STD_RANGE
    log_std = graph.node("Clip", graph.columns(params, continuous, 2 * continuous), min=low, max=high)
    noise = graph.node("RandomNormalLike", means, dtype=graph.FLOAT, mean=0.0, scale=1.0)
    drawn = graph.node("Add", means, graph.node("Mul", noise, graph.node("Exp", log_std)))
    for prefix, values in (("", drawn), ("deterministic_", means)):
        graph.output(f"{prefix}continuous_actions", graph.node("Tanh", values), continuous, graph.FLOAT)
    graph.constant_output("continuous_action_output_shape", [float(continuous)])


def _add_numbers(graph: _Graph, continuous: int, means: str, policy: ActorPolicy) -> None:
    """Numbers in [-1, 1], once drawn and once their means; cut to it, or bent into it as the policy does."""
    network, squashed = policy.network, _squashes(policy.distribution)
    assert network.log_std is not None, "a policy over numbers has a log standard deviation"
    std = np.exp(network.log_std.detach().cpu().numpy().clip(*LOG_STD_RANGE))
    noise = graph.node("RandomNormalLike", means, dtype=graph.FLOAT, mean=0.0, scale=1.0)
    drawn = graph.node("Add", means, graph.node("Mul", noise, graph.constant(std.astype(np.float32))))
    for prefix, values in (("", drawn), ("deterministic_", means)):
        held = graph.node("Tanh", values) if squashed else graph.node("Clip", values, min=-1.0, max=1.0)
        graph.output(f"{prefix}continuous_actions", held, continuous, graph.FLOAT)
    graph.constant_output("continuous_action_output_shape", [float(continuous)])


def _squashes(distribution: Distribution) -> bool:
    numbers = distribution.numbers if isinstance(distribution, Hybrid) else distribution
    return isinstance(numbers, SquashedGaussian)


class _Graph:
    """Collects nodes, weights, inputs and outputs."""

    def __init__(self, onnx: Any) -> None:
        self._onnx, self._helper = onnx, onnx.helper
        self.FLOAT, self.INT64 = onnx.TensorProto.FLOAT, onnx.TensorProto.INT64
        self._nodes: list[Any] = []
        self._weights: list[Any] = []
        self._inputs: list[Any] = []
        self._outputs: list[Any] = []

    def input(self, name: str, shape: Sequence[int]) -> str:
        self._inputs.append(self._helper.make_tensor_value_info(name, self.FLOAT, ["batch", *shape]))
        return name

    def output(self, name: str, value: str, width: int, kind: int) -> None:
        """Name a node's value; nothing else reads it, so no Identity is needed."""
        (source,) = (node for node in self._nodes if value in node.output)
        assert not any(value in node.input for node in self._nodes), f"{value} is read inside the graph too"
        source.output[0] = name
        self._outputs.append(self._helper.make_tensor_value_info(name, kind, ["batch", width]))

    def constant_output(self, name: str, values: Any) -> None:
        array = np.array(values, np.float32)
        self._weights.append(self._onnx.numpy_helper.from_array(array, name))
        self._outputs.append(self._helper.make_tensor_value_info(name, self.FLOAT, array.shape))

    def constant(self, array: Array) -> str:
        name = f"weight_{len(self._weights)}"
        self._weights.append(self._onnx.numpy_helper.from_array(np.ascontiguousarray(array), name))
        return name

    def node(self, kind: str, *inputs: str, **attributes: Any) -> str:
        name = f"{kind}_{len(self._nodes)}"
        self._nodes.append(self._helper.make_node(kind, list(inputs), [name], name=name, **attributes))
        return name

    def masked(self, scores: str, allowed: str) -> str:
        """Scores times mask, less a large penalty where the mask is zero."""
        penalty = self.constant(np.array(FORBIDDEN_PENALTY, np.float32))
        one = self.constant(np.array(1.0, np.float32))
        forbidden = self.node("Mul", self.node("Sub", one, allowed), penalty)
        return self.node("Sub", self.node("Mul", scores, allowed), forbidden)

    def columns(self, values: str, start: int, end: int) -> str:
        return self.node("Slice", values, axes=[1], starts=[start], ends=[end])

    def body(self, body: Encoder, inputs: Mapping[str, str]) -> str:
        parts = [self.layers(embedder, inputs[name]) for name, embedder in zip(body.names, body.embedders, strict=True)]
        return self.layers(body.trunk, self.node("Concat", *parts, axis=1) if len(parts) > 1 else parts[0])

    def layers(self, module: nn.Module, value: str) -> str:
        """Write a module's layers in order."""
        match module:
            case nn.Sequential():
                for layer in module:
                    value = self.layers(layer, value)
                return value
            case nn.Linear():
                return self.dense(module, value)
            case nn.Conv2d():
                weights = [self.constant(_array(module.weight))]
                if module.bias is not None:
                    weights.append(self.constant(_array(module.bias)))
                shape = {"kernel_shape": list(module.kernel_size), "strides": list(module.stride)}
                return self.node("Conv", value, *weights, pads=[0, 0, 0, 0], **shape)
            case nn.ReLU():
                return self.node("Relu", value)
            case nn.Tanh():
                return self.node("Tanh", value)
            case Image():
                return value  # Unity's pictures are NCHW in [0, 1] already
            case FlattenChannelsLast():
                return self.node("Flatten", self.node("Transpose", value, perm=[0, 2, 3, 1]), axis=1)
            case Vector():
                return self.vector(module, value)
        raise UserInputError(
            "a layer of kind {type_name} cannot be exported to Unity yet.", type_name=type(module).__name__
        )

    def vector(self, module: Vector, value: str) -> str:
        """Write numbers side by side, scaled as the running statistics stand now."""
        flat = self.node("Flatten", value, axis=1)
        if module.statistics is None:
            return flat
        mean, deviation = map(_array, module.statistics.mean_and_deviation())
        scaled = self.node("Div", self.node("Sub", flat, self.constant(mean)), self.constant(deviation))
        return self.node("Clip", scaled, min=-MAX_DEVIATIONS, max=MAX_DEVIATIONS)

    def dense(self, layer: nn.Linear, value: str) -> str:
        bias = layer.bias if layer.bias is not None else torch.zeros(layer.out_features)
        return self.node("Gemm", value, self.constant(_array(layer.weight)), self.constant(_array(bias)), transB=1)

    def finish(self, name: str) -> Any:
        graph = self._helper.make_graph(self._nodes, name, self._inputs, self._outputs, self._weights)
        model = self._helper.make_model(
            graph,
            producer_name="racecraft",
            opset_imports=[self._helper.make_opsetid("", OPSET)],
            ir_version=IR_VERSION,
        )
        self._onnx.checker.check_model(model, full_check=True)
        return model


def _wire_shape(sensor: Sensor) -> tuple[int, ...]:
    if sensor.is_picture:
        height, width, channels = sensor.shape
        return channels, height, width
    return sensor.shape


def _array(weight: torch.Tensor) -> Array:
    return np.asarray(weight.detach().cpu().contiguous().numpy(), np.float32)


def _onnx() -> Any:
    try:
        import onnx
        import onnx.numpy_helper  # not every release brings it along
    except ImportError as cause:
        raise _missing("onnx") from cause
    return onnx


def _missing(package: str) -> MissingExtraError:
    return MissingExtraError(
        "Exporting to Unity needs the package '{package}', which is not installed. pip install 'racecraft[onnx]'",
        package=package,
    )
