"""A car's policy as OpenVINO's own files, `.xml` and `.bin`: the one door to OpenVINO. Begin with `openvino_files`.

OpenVINO reads the same frozen graph that a car gets, with the shapes that a car's converter gives it: one frame at a
time. Its inputs and its output keep their names, and so what the output means: SAC's mean stands before the tanh. The
numbers stay float32; a car that converts a graph itself halves them.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import MissingExtraError
from racecraft.contract.world import Array
from racecraft.formats.aws.policy_graph import as_commands, graph_of
from racecraft.formats.aws.policy_layers import PolicyLayers
from racecraft.formats.tensorflow.graph import write_graph

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
    with tempfile.TemporaryDirectory(prefix="racecraft-openvino-") as folder:
        place = Path(folder)
        (place / "model.pb").write_bytes(write_graph(graph_of(policy)))
        # read_model, not convert_model: the latter asks a telemetry service first.
        model = openvino.Core().read_model(place / "model.pb")
        shapes = {sensor.name: [1, *sensor.shape] for sensor in policy.network.sensors}
        model.reshape({place: shapes[_sensor_of(place)] for place in model.inputs})
        openvino.save_model(model, place / f"{_STEM}.xml", compress_to_fp16=False)
        return {end: (place / f"{_STEM}{end}").read_bytes() for end in (".bin", ".xml")}


def openvino_answer(policy: PolicyLayers, files: Mapping[str, bytes]) -> Callable[[Mapping[str, Array]], Array]:
    """Return written files as what answers about sensors (`agreement.Answer`).

    Raises:
        MissingExtraError: openvino is not installed.
    """
    openvino = _openvino()
    core = openvino.Core()
    with tempfile.TemporaryDirectory(prefix="racecraft-openvino-") as folder:
        for end, content in files.items():
            (Path(folder) / f"{_STEM}{end}").write_bytes(content)
        told = {"INFERENCE_PRECISION_HINT": "f32"}  # some processors would halve the numbers
        model = core.compile_model(core.read_model(Path(folder) / f"{_STEM}.xml"), "CPU", told)

    def answer(seen: Mapping[str, Array]) -> Array:
        count = len(next(iter(seen.values())))
        rows = [
            model([seen[_sensor_of(place)][row : row + 1] for place in model.inputs])[model.output(0)].copy()
            for row in range(count)
        ]
        return as_commands(policy.kind, np.concatenate(rows))

    return answer


def _sensor_of(place: Any) -> str:
    """Return the sensor that an input is for: names are like `main_level/…/LIDAR/LIDAR:0`."""
    return str(sorted(place.get_names())[0]).rpartition("/")[2].partition(":")[0]


def _openvino() -> Any:
    try:
        import openvino
    except ImportError as cause:
        raise MissingExtraError(
            "Exporting to OpenVINO needs the package 'openvino', which is not installed. "
            "pip install 'racecraft[openvino]'"
        ) from cause
    return openvino
