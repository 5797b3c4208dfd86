"""A car's policy as an ONNX file, and that file as a policy. Begin with `onnx_files`.

    in    FRONT_FACING_CAMERA, LIDAR …    float [batch, 120, 160, channels] from 0 to 255, or [batch, numbers]
    out   policy                          float [batch, actions]: likelihoods, or commands in [-1, 1] units

`model_metadata.json` travels as a property of the model: what the actions mean stands there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from racecraft.contract.errors import MissingExtraError
from racecraft.contract.world import Array
from racecraft.formats.policy_layers import DISCRETE, SAC, DenseLayer, PolicyLayers, SensorLayers

OPSET = 13
IR_VERSION = 7
OUTPUT = "policy"
BATCH = "batch"


def onnx_files(policy: PolicyLayers, metadata: str) -> dict[str, bytes]:
    """Return the files to write, by their ends.

    Args:
        policy: Its layers.
        metadata: The text of model_metadata.json.

    Raises:
        MissingExtraError: onnx is not installed.
    """
    try:
        import onnx
        import onnx.numpy_helper  # not every release brings it along
    except ImportError as cause:
        raise _missing("onnx") from cause
    graph = _Graph(onnx)
    graph.policy(policy)
    return {".onnx": graph.finish(policy, metadata).SerializeToString()}


def onnx_answer(policy: PolicyLayers, files: Mapping[str, bytes]) -> Callable[[Mapping[str, Array]], Array]:
    """Return written files as what answers about sensors (`agreement.Answer`).

    Raises:
        MissingExtraError: onnxruntime is not installed.
    """
    try:
        import onnxruntime
    except ImportError as cause:
        raise _missing("onnxruntime") from cause
    session = onnxruntime.InferenceSession(files[".onnx"], providers=["CPUExecutionProvider"])

    def answer(seen: Mapping[str, Array]) -> Array:
        return np.asarray(session.run([OUTPUT], dict(seen))[0])

    return answer


class _Graph:
    """Nodes one behind the other; `last` is the name of what the latest gave."""

    def __init__(self, onnx: Any) -> None:
        self._onnx, self.last = onnx, ""
        self._nodes: list[Any] = []
        self._weights: list[Any] = []

    def policy(self, policy: PolicyLayers) -> None:
        """Add the whole policy."""
        joined = []
        for sensor in policy.network.sensors:
            self.sensor(sensor, policy.network.activation)
            joined.append(self.last)
        if len(joined) > 1:
            self._add("Concat", joined, axis=1)
        for layer in policy.network.trunk:
            self.dense(layer)
            self._add(_ACTIVATIONS[policy.network.activation])
        self.dense(policy.network.head)
        self.end(policy.kind)
        self._nodes[-1].output[0] = OUTPUT

    def sensor(self, sensor: SensorLayers, activation: str) -> None:
        """Add what one sensor's numbers go through."""
        self.last = sensor.name
        if sensor.is_image:
            self._add("Mul", [self.last, self._weight(np.full(1, 1 / 255, np.float32))])
            self._add("Transpose", perm=[0, 3, 1, 2])
        if sensor.shrink > 1:
            self._add("AveragePool", kernel_shape=[sensor.shrink] * 2, strides=[sensor.shrink] * 2)
        for layer in sensor.convolutions:
            kernel = np.ascontiguousarray(layer.kernel.transpose(3, 2, 0, 1))
            self._add("Conv", [self.last, self._weight(kernel), self._weight(layer.bias)], strides=[layer.stride] * 2)
            self._add(_ACTIVATIONS[activation])
        if sensor.is_image:
            self._add("Transpose", perm=[0, 2, 3, 1])
            self._add("Flatten", axis=1)
        for dense in sensor.dense:
            self.dense(dense)
            self._add(_ACTIVATIONS[activation])

    def end(self, kind: str) -> None:
        """Add what makes likelihoods, or commands in [-1, 1] units, of the last layer."""
        if kind == DISCRETE:
            self._add("Softmax", axis=1)
        elif kind == SAC:
            self._add("Tanh")
        else:
            self._add("Clip", [self.last, *(self._weight(np.asarray(end, np.float32)) for end in (-1.0, 1.0))])

    def dense(self, layer: DenseLayer) -> None:
        """Add a dense layer."""
        self._add("Gemm", [self.last, self._weight(layer.kernel), self._weight(layer.bias)])

    def finish(self, policy: PolicyLayers, metadata: str) -> Any:
        """Return the model, looked over by ONNX's own checker."""
        helper, kind = self._onnx.helper, self._onnx.TensorProto.FLOAT
        inputs = [
            helper.make_tensor_value_info(sensor.name, kind, [BATCH, *sensor.shape])
            for sensor in policy.network.sensors
        ]
        actions = policy.network.head.bias.shape[0]
        outputs = [helper.make_tensor_value_info(OUTPUT, kind, [BATCH, actions])]
        graph = helper.make_graph(self._nodes, "racecraft", inputs, outputs, self._weights)
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="racecraft")
        model.ir_version = IR_VERSION
        helper.set_model_props(model, {"model_metadata": metadata})
        self._onnx.checker.check_model(model, full_check=True)
        return model

    def _add(self, op: str, read: list[str] | None = None, **told: Any) -> None:
        name = f"{op}_{len(self._nodes)}"
        self._nodes.append(self._onnx.helper.make_node(op, read or [self.last], [name], name=name, **told))
        self.last = name

    def _weight(self, array: Array) -> str:
        name = f"weight_{len(self._weights)}"
        self._weights.append(self._onnx.numpy_helper.from_array(np.asarray(array, np.float32, order="C"), name))
        return name


_ACTIVATIONS = {"relu": "Relu", "tanh": "Tanh"}


def _missing(package: str) -> MissingExtraError:
    return MissingExtraError(
        "Exporting to ONNX needs the package '{package}', which is not installed. pip install 'racecraft[onnx]'",
        package=package,
    )
