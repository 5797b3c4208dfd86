"""What runtimes share that are handed a car's frozen graph and take one frame at a time, as the software on a car does.

OpenVINO's and TensorFlow Lite's files are made of the graph that `model.pb` holds: each converter reads it from a file,
and is told the shapes of one frame. The file's name for an input ends in its sensor's.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.policy_layers import PolicyLayers
from racecraft.worlds.deepracer.export.agreement import Answer
from racecraft.worlds.deepracer.files.policy_graph import as_commands, graph_of
from racecraft.worlds.deepracer.files.tensorflow.graph import write_graph


@contextlib.contextmanager
def graph_file(policy: PolicyLayers) -> Iterator[Path]:
    """Yield a policy as a frozen graph in a folder of its own, which goes with the block."""
    with tempfile.TemporaryDirectory(prefix="racecraft-graph-") as folder:
        path = Path(folder) / "model.pb"
        path.write_bytes(write_graph(graph_of(policy)))
        yield path


def frame_shapes(policy: PolicyLayers) -> dict[str, list[int]]:
    """Return the shape of one frame by sensor: [1, rows, columns, channels] of an image, [1, numbers] of a LiDAR."""
    return {sensor.name: [1, *sensor.shape] for sensor in policy.network.sensors}


def sensor_of(name: str) -> str:
    """Return the sensor that an input is for.

    >>> sensor_of("main_level/agent/main/online/network_0/LIDAR/LIDAR:0")
    'LIDAR'
    """
    return name.rpartition("/")[2].partition(":")[0]


def answer_by_frame(kind: str, ask: Callable[[Mapping[str, Array]], Array]) -> Answer:
    """Return what answers about many frames by asking about each alone.

    Args:
        kind: The policy's, which says what the answers mean.
        ask: Answers about one frame, (1, …) by sensor, with (1, actions).
    """

    def answer(seen: Mapping[str, Array]) -> Array:
        count = len(next(iter(seen.values())))
        rows = [ask({name: numbers[row : row + 1] for name, numbers in seen.items()}) for row in range(count)]
        return as_commands(kind, np.concatenate(rows))

    return answer
