"""From a run folder to the archive that a physical car drives with, checked. Begin with `export_to_car`.

The check lets the written graph itself answer, by its own arithmetic in NumPy, beside the checkpoint.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from racecraft.algorithms.plain_layers import layers_of
from racecraft.algorithms.weights import to_arrays
from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array
from racecraft.formats.archive import GZIPPED
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.policy_layers import SAC, PolicyLayers
from racecraft.worlds.deepracer.export.agreement import Agreement, Answer, compare
from racecraft.worlds.deepracer.files.car_archive import write_car_archive
from racecraft.worlds.deepracer.files.policy_graph import as_commands, graph_of, input_name, output_name
from racecraft.worlds.deepracer.files.sensor_names import SENSORS
from racecraft.worlds.deepracer.files.tensorflow.arithmetic import GraphFunction
from racecraft.worlds.deepracer.files.tensorflow.graph import graph_in, write_graph
from racecraft.worlds.deepracer.players.trained_car import TrainedCar, load_trained_car

CARS_SENSORS = tuple(one.name for one in SENSORS if one.is_on_cars)
"""Those that the software on a physical car knows."""

AT_ONCE = 16
"""Frames that a graph is asked about together: what lies between its layers is megabytes a frame."""


@dataclass(frozen=True)
class CarExport:
    """A written archive and how it was checked."""

    path: Path
    checkpoint: int
    shrink: int
    """How many pixels, across and down, the graph averages to one."""
    agreement: Agreement | None
    """None: it was not checked."""
    notes: tuple[str, ...] = ()
    """What a physical car may not be able to do with it, a clause each."""


def export_to_car(
    run: str | Path, which: str = "best", output: str | Path | None = None, check: bool = True
) -> CarExport:
    """Write the policy of a run as the archive that a physical car takes.

    Args:
        run: The run folder of `racecraft train`.
        which: "best", "last" or the number of an iteration.
        output: A file that ends in .tar.gz, or a folder; None for `<run>/export`.
        check: Whether graph and checkpoint are asked side by side first.

    Raises:
        SettingError: The output's name ends otherwise.
        RunFolderError: No run folder, or the run of another kind of world.
        CheckpointError: No such checkpoint.
        NoPlainLayersError: A car's software does not know such a policy.
        ExportError: The graph does not act as the checkpoint does; nothing is written.
    """
    if output is not None and not _is_place(Path(output)):
        raise SettingError("--output {output}: expected a file that ends in .tar.gz, or a folder.", output=output)
    car = load_trained_car(run, which)
    policy = car_layers(car)
    written = write_graph(graph_of(policy))
    agreement = compare(car, policy, graph_answer(policy, written)) if check else None
    place = Path(output) if output is not None else car.run.path / "export"
    path = write_car_archive(place, written, metadata_text(car))
    return CarExport(path, car.checkpoint.iteration, policy.network.shrink, agreement, tuple(_notes(policy)))


def car_layers(car: TrainedCar) -> PolicyLayers:
    """Return a trained car's layers, under the names of the sensors in its metadata.

    Raises:
        NoPlainLayersError: A car's software does not know such a policy.
    """
    weights, _ = Checkpoints(car.run.checkpoints).load_policy(str(car.checkpoint.iteration))
    return layers_of(car.policy.spec, to_arrays(weights), sorted(car.policy.metadata["model_metadata"]["sensor"]))


def graph_answer(policy: PolicyLayers, written: bytes) -> Answer:
    """Return a written graph as what answers about sensors."""
    function = GraphFunction(graph_in(written, "model.pb"), output_name(policy.kind))

    def answer(seen: Mapping[str, Array]) -> Array:
        count = len(next(iter(seen.values())))
        outputs = [
            function({input_name(policy.kind, name): seen[name][first : first + AT_ONCE] for name in seen})
            for first in range(0, count, AT_ONCE)
        ]
        return as_commands(policy.kind, np.concatenate(outputs))

    return answer


def metadata_text(car: TrainedCar) -> str:
    """Return a car's model_metadata.json, its sensors in the order in which the graph is fed.

    A car's converter to OpenVINO lays the sensors of the metadata beside the graph's inputs one by one, by their place.
    """
    metadata = dict(car.policy.metadata["model_metadata"])
    metadata["sensor"] = sorted(metadata["sensor"])
    return json.dumps(metadata, indent=2) + "\n"


def _is_place(output: Path) -> bool:
    """Tell whether an archive may go there: a folder that stands, a new one without an end, or an archive's name."""
    return output.is_dir() or not output.suffix or output.name.endswith(GZIPPED)


def _notes(policy: PolicyLayers) -> list[str]:
    notes = [
        f"a physical car's software knows no sensor {sensor.name}, so it cannot load this model"
        for sensor in policy.network.sensors
        if sensor.name not in CARS_SENSORS
    ]
    if policy.kind == SAC:
        notes.append("a car that runs TensorFlow Lite asks every model for PPO's output and cannot load one of SAC")
    return notes
