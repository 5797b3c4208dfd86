"""A car's policy as OpenVINO's own files, `.xml` and `.bin`: the one door to OpenVINO. Begin with `openvino_files`.

OpenVINO reads the same frozen graph that a car gets, with the shapes that a car's converter gives it: one frame at a
time. Its inputs and its output keep their names, and so what the output means: SAC's mean stands before the tanh. The
numbers stay float32; a car that converts a graph itself halves them.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from racecraft.contract.errors import MissingExtraError
from racecraft.contract.world import Array
from racecraft.formats.policy_layers import PolicyLayers
from racecraft.worlds.deepracer.export.agreement import Answer
from racecraft.worlds.deepracer.export.frame_by_frame import answer_by_frame, frame_shapes, graph_file, sensor_of

_STEM = "policy"


def openvino_files(policy: PolicyLayers, metadata: str) -> dict[str, bytes]:
    """Return the files to write, by their ends.

    Args:
        policy: Its layers.
        metadata: The text of model_metadata.json, which has no place in these files.

    Raises:
        MissingExtraError: openvino is not installed.
    """
    openvino = _openvino()
    shapes = frame_shapes(policy)
    with graph_file(policy) as graph:
        # read_model, not convert_model: the latter asks a telemetry service first.
        model = openvino.Core().read_model(graph)
        model.reshape({place: shapes[_sensor_at(place)] for place in model.inputs})
        written = graph.with_name(f"{_STEM}.xml")
        openvino.save_model(model, written, compress_to_fp16=False)
        return {end: written.with_suffix(end).read_bytes() for end in (".bin", ".xml")}


def openvino_answer(policy: PolicyLayers, files: Mapping[str, bytes]) -> Answer:
    """Return written files as what answers about sensors.

    Raises:
        MissingExtraError: openvino is not installed.
    """
    openvino = _openvino()
    core = openvino.Core()
    with tempfile.TemporaryDirectory(prefix="racecraft-openvino-") as folder:
        for end, content in files.items():
            (Path(folder) / f"{_STEM}{end}").write_bytes(content)
        options = {"INFERENCE_PRECISION_HINT": "f32"}  # some processors would halve the numbers
        model = core.compile_model(core.read_model(Path(folder) / f"{_STEM}.xml"), "CPU", options)

    def ask(frame: Mapping[str, Array]) -> Array:
        answered: Array = model([frame[_sensor_at(place)] for place in model.inputs])[model.output(0)].copy()
        return answered

    return answer_by_frame(policy.kind, ask)


def _sensor_at(place: Any) -> str:
    return sensor_of(str(sorted(place.get_names())[0]))


def _openvino() -> Any:
    try:
        import openvino
    except ImportError as cause:
        raise MissingExtraError(
            "Exporting to OpenVINO needs the package 'openvino', which is not installed. "
            "pip install 'racecraft[openvino]'"
        ) from cause
    return openvino
