"""A car's policy as a TensorFlow Lite file: the one door to TensorFlow. Begin with `tflite_files`.

TensorFlow's own converter makes it of the frozen graph that a car gets, by the names of its inputs and for one frame at
a time, as the software on a car does. The output means what the graph's does: SAC's mean stands before the tanh. The
numbers stay float32.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from typing import Any

from racecraft.contract.errors import MissingExtraError
from racecraft.contract.world import Array
from racecraft.formats.policy_layers import PolicyLayers
from racecraft.worlds.deepracer.export.agreement import Answer
from racecraft.worlds.deepracer.export.frame_by_frame import answer_by_frame, frame_shapes, graph_file, sensor_of
from racecraft.worlds.deepracer.files.policy_graph import input_name, output_name


def tflite_files(policy: PolicyLayers, metadata: str) -> dict[str, bytes]:
    """Return the file to write, by its end.

    Args:
        policy: Its layers.
        metadata: The text of model_metadata.json, which has no place in this file.

    Raises:
        MissingExtraError: TensorFlow is not installed.
    """
    tensorflow = _tensorflow()
    shapes = {input_name(policy.kind, name): shape for name, shape in frame_shapes(policy).items()}
    with graph_file(policy) as graph:
        converter = tensorflow.compat.v1.lite.TFLiteConverter.from_frozen_graph(
            str(graph), input_arrays=list(shapes), input_shapes=shapes, output_arrays=[output_name(policy.kind)]
        )
        return {".tflite": bytes(converter.convert())}


def tflite_answer(policy: PolicyLayers, files: Mapping[str, bytes]) -> Answer:
    """Return a written file as what answers about sensors.

    Raises:
        MissingExtraError: TensorFlow is not installed.
    """
    interpreter = _interpreter()(model_content=files[".tflite"])
    interpreter.allocate_tensors()
    places = {sensor_of(one["name"]): one["index"] for one in interpreter.get_input_details()}
    (output,) = interpreter.get_output_details()

    def ask(frame: Mapping[str, Array]) -> Array:
        for name, numbers in frame.items():
            interpreter.set_tensor(places[name], numbers)
        interpreter.invoke()
        answered: Array = interpreter.get_tensor(output["index"])
        return answered

    return answer_by_frame(policy.kind, ask)


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
