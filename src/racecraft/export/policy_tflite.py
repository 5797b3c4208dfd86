"""A car's policy as a TensorFlow Lite file: the one door to TensorFlow. Begin with `tflite_files`.

TensorFlow's own converter makes it of the frozen graph that a car gets, by the names of its inputs and for one frame at
a time, as the software on a car does. The output means what the graph's does: SAC's mean stands before the tanh. The
numbers stay float32.
"""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import MissingExtraError
from racecraft.contract.world import Array
from racecraft.formats.aws.policy_graph import as_commands, graph_of, input_name, output_name
from racecraft.formats.aws.policy_layers import PolicyLayers
from racecraft.formats.tensorflow.graph import write_graph


def tflite_files(policy: PolicyLayers, metadata: str) -> dict[str, bytes]:
    """Return the file to write, by its end.

    Args:
        policy: Its layers.
        metadata: The text of model_metadata.json, which has no place in this file.

    Raises:
        MissingExtraError: TensorFlow is not installed.
    """
    tensorflow = _tensorflow()
    shapes = {input_name(policy.kind, sensor.name): [1, *sensor.shape] for sensor in policy.network.sensors}
    with tempfile.TemporaryDirectory(prefix="racecraft-tflite-") as folder:
        graph = Path(folder) / "model.pb"
        graph.write_bytes(write_graph(graph_of(policy)))
        converter = tensorflow.compat.v1.lite.TFLiteConverter.from_frozen_graph(
            str(graph), input_arrays=list(shapes), input_shapes=shapes, output_arrays=[output_name(policy.kind)]
        )
        return {".tflite": bytes(converter.convert())}


def tflite_answer(policy: PolicyLayers, files: Mapping[str, bytes]) -> Callable[[Mapping[str, Array]], Array]:
    """Return a written file as what answers about sensors (`agreement.Answer`).

    Raises:
        MissingExtraError: TensorFlow is not installed.
    """
    interpreter = _interpreter()(model_content=files[".tflite"])
    interpreter.allocate_tensors()
    places = {one["name"].rpartition("/")[2]: one["index"] for one in interpreter.get_input_details()}
    (output,) = interpreter.get_output_details()

    def answer(seen: Mapping[str, Array]) -> Array:
        rows = []
        for row in range(len(next(iter(seen.values())))):
            for name, numbers in seen.items():
                interpreter.set_tensor(places[name], numbers[row : row + 1])
            interpreter.invoke()
            rows.append(interpreter.get_tensor(output["index"]))
        return as_commands(policy.kind, np.concatenate(rows))

    return answer


def _interpreter() -> Any:
    """Return the class that computes such a file: TensorFlow's own, or that of the package it is moving to."""
    interpreter = getattr(_tensorflow().lite, "Interpreter", None)
    if interpreter is not None:
        return lambda model_content: _silently(interpreter, model_content)
    try:
        from ai_edge_litert.interpreter import Interpreter
    except ImportError as cause:
        raise MissingExtraError(
            "Asking a TensorFlow Lite file beside the checkpoint needs the package 'ai-edge-litert', which is not "
            "installed. pip install ai-edge-litert, or write it unasked with --no-check."
        ) from cause
    return Interpreter


def _silently(interpreter: Any, model_content: bytes) -> Any:
    """Return an interpreter without TensorFlow's notice that the class will move."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return interpreter(model_content=model_content)


def _tensorflow() -> Any:
    os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
    try:
        import tensorflow
    except ImportError as cause:
        raise MissingExtraError(
            "Exporting to TensorFlow Lite needs TensorFlow's own converter, which is not installed. "
            "pip install 'racecraft[tflite]'"
        ) from cause
    return tensorflow
