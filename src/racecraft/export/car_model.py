"""From a run folder to the archive that a physical car drives with, checked. Begin with `export_to_car`.

The check lets the written graph itself answer, by its own arithmetic in NumPy, beside the checkpoint: on frames that
the car sees while it drives its own track, every action must be the same. A policy that was trained on smaller frames
gets a graph that averages the car's 160 x 120 pixels down to them; there the checkpoint is shown the same averages, and
besides it is told how often the graph decides as the checkpoint does on the simulator's own small frames.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.algorithms.plain_layers import NoPlainLayersError, layers_of
from racecraft.algorithms.weights import to_arrays
from racecraft.contract.errors import RacecraftError
from racecraft.contract.world import Array
from racecraft.envs.deepracer.sensors import STEREO
from racecraft.envs.deepracer.world import CAMERA_NAME
from racecraft.export.car_frames import Frames, drive_for_frames
from racecraft.formats.aws.car_archive import write_car_archive
from racecraft.formats.aws.policy_graph import graph_of, input_name, output_name
from racecraft.formats.aws.policy_layers import DISCRETE, SAC, PolicyLayers
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.tensorflow.arithmetic import GraphFunction
from racecraft.formats.tensorflow.graph import graph_in, write_graph
from racecraft.players.deepracer.trained_car import TrainedCar, load_trained_car

TOLERANCE = 1e-4
"""How far numbers in [-1, 1] units, and likelihoods, may lie apart: float32, sums in another order."""


class ExportError(RacecraftError):
    """A model does not act as its checkpoint does; no file is written."""


@dataclass(frozen=True)
class Agreement:
    """How a written graph answered beside the checkpoint."""

    frames: int
    """On how many frames they were asked; every action agreed."""
    largest_difference: float
    """Of likelihoods of choices, or of numbers in [-1, 1] units."""
    small_frames_share: float | None
    """Share of the simulator's own small frames on which both choose alike, where the graph averages pixels; None: it
    does not."""


@dataclass(frozen=True)
class CarExport:
    """A written archive and how it was checked."""

    path: Path
    checkpoint: int
    shrink: int
    """How many pixels, across and down, the graph averages to one."""
    agreement: Agreement | None
    """None: it was not checked."""


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
        RunFolderError: No run folder, or the run of another kind of world.
        CheckpointError: No such checkpoint.
        NoPlainLayersError: A car's software does not know such a policy.
        ExportError: The graph does not act as the checkpoint does; nothing is written.
    """
    car = load_trained_car(run, which)
    policy = car_layers(car)
    written = write_graph(graph_of(policy))
    agreement = compare(car, policy, written) if check else None
    place = Path(output) if output is not None else car.run.path / "export"
    path = write_car_archive(place, written, json.dumps(car.policy.metadata["model_metadata"], indent=2) + "\n")
    return CarExport(path, car.checkpoint.iteration, policy.network.sensors[0].shrink, agreement)


def car_layers(car: TrainedCar) -> PolicyLayers:
    """Return a trained car's layers, under the names of the sensors in its metadata.

    Raises:
        NoPlainLayersError: It sees by more than its front camera, or a car's software does not know such a policy.
    """
    seen = sorted(car.policy.spec.visible)
    if seen != [CAMERA_NAME]:
        raise NoPlainLayersError(
            f"{car.run.path}: the policy sees by {', '.join(seen)}; expected {CAMERA_NAME} alone. Graphs of several "
            "sensors are not written yet."
        )
    weights, _ = Checkpoints(car.run.checkpoints).load_policy(str(car.checkpoint.iteration))
    return layers_of(car.policy.spec, to_arrays(weights), sorted(car.policy.metadata["model_metadata"]["sensor"]))


def compare(car: TrainedCar, policy: PolicyLayers, written: bytes) -> Agreement:
    """Ask a written graph and its checkpoint side by side.

    Raises:
        ExportError: They do not act alike.
    """
    function = GraphFunction(graph_in(written, "model.pb"), output_name(policy.kind))
    frames, shrink = drive_for_frames(car), policy.network.sensors[0].shrink
    name = input_name(policy.kind, policy.network.sensors[0].name)
    told = function({name: frames.whole[..., None]})
    same = {CAMERA_NAME: frames.whole if shrink == 1 else averages(frames.whole, shrink)}
    difference = _difference(policy.kind, car, told, same)
    if difference > TOLERANCE:
        raise ExportError(
            f"{car.run.path}: the exported graph's answers are up to {difference:g} away from the checkpoint's; "
            f"expected {TOLERANCE:g} at most. Nothing was written. Please report this with the run folder."
        )
    share = None if shrink == 1 else _share_alike(policy.kind, car, told, frames)
    return Agreement(len(frames.whole), difference, share)


def averages(frames: Array, shrink: int) -> Array:
    """Return frames (R, H, W) in squares of `shrink` pixels averaged to one, float32 shares of white (R, H/s, W/s)."""
    rows, height, width = frames.shape
    squares = frames.reshape(rows, height // shrink, shrink, width // shrink, shrink)
    return squares.mean(axis=(2, 4), dtype=np.float32) / np.float32(255.0)


def _difference(kind: str, car: TrainedCar, told: Array, seen: Mapping[str, Array]) -> float:
    """Return the largest difference of any answer; infinite where an action differs that is no tie."""
    if kind != DISCRETE:
        return float(np.abs(_units(kind, told) - _in_units(car, car.policy.act(seen))).max())
    likely = car.policy.probabilities(seen)
    chosen, asked = told.argmax(axis=1), likely.argmax(axis=1)
    rows = np.arange(len(told))
    tied = likely[rows, asked] - likely[rows, chosen] < TOLERANCE
    if not (tied | (chosen == asked)).all():
        return float("inf")
    return float(np.abs(told - likely).max())


def _share_alike(kind: str, car: TrainedCar, told: Array, frames: Frames) -> float:
    """Return on which share of the simulator's small frames the checkpoint decides as the graph on the whole ones."""
    actions = car.policy.act({CAMERA_NAME: frames.seen})
    if kind == DISCRETE:
        return float((told.argmax(axis=1) == actions).mean())
    return float((np.abs(_units(kind, told) - _in_units(car, actions)).max(axis=1) < _ALIKE).mean())


_ALIKE = 0.1
"""Two commands are alike when they lie within a twentieth of their range."""


def _units(kind: str, told: Array) -> Array:
    """Return a graph's numbers as commands in [-1, 1] units: held to them, or bent by the tanh of SAC."""
    return np.tanh(told) if kind == SAC else np.clip(told, -1.0, 1.0)


def _in_units(car: TrainedCar, actions: Array) -> Array:
    """Return commands as shares of their ranges, [-1, 1]."""
    spec: Any = car.policy.spec.actions
    low, high = np.asarray(spec.low, np.float32), np.asarray(spec.high, np.float32)
    return (2.0 * (actions - low) / (high - low) - 1.0).astype(np.float32)
