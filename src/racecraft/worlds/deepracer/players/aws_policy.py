"""A state of a model of AWS's trainer as a policy of ours. Begin with `read_foreign_policy`.

Weights are read by our own small readers; where the file tells the graph as well, the graph itself answers beside the
one that its layers make up, and what disagrees is refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from racecraft.algorithms.plain_layers import ForeignPolicy, policy_of
from racecraft.contract.message import Message
from racecraft.contract.world import Array, ArraySpec
from racecraft.formats.policy_layers import IMAGE, PolicyLayers, PolicyLayersError
from racecraft.worlds.deepracer.env.actions import action_space
from racecraft.worlds.deepracer.env.race_spec import world_spec
from racecraft.worlds.deepracer.env.sensors import STEREO, car_sensors
from racecraft.worlds.deepracer.env.settings import CameraConfig
from racecraft.worlds.deepracer.files.model_metadata import ModelMetadata
from racecraft.worlds.deepracer.files.policy_graph import (
    as_commands,
    bare_lidars_in,
    graph_of,
    input_name,
    output_name,
    policy_output_in,
    read_policy_graph,
    strides_in,
)
from racecraft.worlds.deepracer.files.policy_weights import is_of_policy, layers_from
from racecraft.worlds.deepracer.files.tensorflow.arithmetic import GraphArithmeticError, GraphFunction
from racecraft.worlds.deepracer.files.tensorflow.checkpoint import INDEX, read_checkpoint
from racecraft.worlds.deepracer.files.tensorflow.graph import read_meta_graph
from racecraft.worlds.deepracer.files.trained_model import ForeignModelError, ForeignWeights

ASKED_FRAMES, AT_ONCE = 8, 2
"""Frames that a graph is asked about, and how many of them together: a large network's maps are megabytes a frame."""
TOLERANCE = 1e-4
"""How far answers of a file's graph, and of the one that its layers make up, may lie apart."""


def read_foreign_policy(weights: ForeignWeights, car: ModelMetadata) -> ForeignPolicy:
    """Return the policy of a state of a model, having asked its graph beside its layers where there is one.

    Args:
        weights: Where it lies.
        car: What its car sees and can do.

    Raises:
        ForeignModelError: Its layers are none of AWS's, fit another car, or tell less than its graph computes.
        TensorFlowCheckpointError: A checkpoint is damaged.
        GraphError: A graph is damaged, or holds no policy of a car.
        GraphArithmeticError: A graph computes with what we do not know.
    """
    try:
        layers, function, notes = _read(weights)
        _require_named_sensors(weights.path, layers, car)
        if function is not None:
            _require_same_answers(weights.path, layers, function)
    except GraphArithmeticError as error:
        raise GraphArithmeticError("{path}: {error}", path=weights.path, error=error) from error
    try:
        policy = policy_of(layers, _observations(car, layers), action_space(car.action_space).spec)
    except PolicyLayersError as error:
        raise _model_error(weights.path, error) from error
    return ForeignPolicy(policy.spec, policy.weights, (*policy.notes, *notes))


def _read(weights: ForeignWeights) -> tuple[PolicyLayers, GraphFunction | None, tuple[str, ...]]:
    """Return a file's layers, and its graph as a function where it tells one that we can compute."""
    if weights.is_graph:
        return (*read_policy_graph(weights.path), ())
    arrays = read_checkpoint(weights.path, is_of_policy)
    meta = Path(str(weights.path).removesuffix(INDEX) + ".meta")
    strides: Mapping[str, int] = {}
    lidars: Mapping[str, int] = {}
    function: GraphFunction | None = None
    notes: tuple[str, ...] = ()
    try:
        if meta.is_file():
            graph = read_meta_graph(meta)
            strides, lidars = strides_in(graph), bare_lidars_in(graph)
            function = GraphFunction(graph, policy_output_in(graph, meta), arrays)
    except GraphArithmeticError as error:
        notes = (f"{meta.name} was not asked beside the network: {error}",)
    try:
        return layers_from(arrays, strides, 1, lidars), function, notes
    except PolicyLayersError as error:
        raise _model_error(weights.path, error) from error


def _model_error(path: Path, error: PolicyLayersError) -> ForeignModelError:
    found, _, expected = str(error).partition("; expected ")
    return ForeignModelError(path, found, expected.rstrip(".") or "AWS's layers")


def _observations(car: ModelMetadata, layers: PolicyLayers) -> dict[str, ArraySpec]:
    shrink = layers.network.shrink
    camera = CameraConfig(width=IMAGE[1] // shrink, height=IMAGE[0] // shrink)
    sensors = car_sensors(car.sensors, car.lidar_config)
    return dict(world_spec(action_space(car.action_space), camera, sensors=sensors).observations)


def _require_named_sensors(path: Path, layers: PolicyLayers, car: ModelMetadata) -> None:
    """Refuse a network that is fed by other sensors than its car has.

    Cameras of one eye see the same by each of their names, where they are alone; beside a LiDAR, the name decides
    which of both comes first.

    Raises:
        ForeignModelError: The message names both.
    """
    there = [sensor.name for sensor in layers.network.sensors]
    one_eyed = len(there) == 1 == len(car.sensors) and STEREO not in (*there, *car.sensors)
    if not one_eyed and there != sorted(car.sensors):
        raise ForeignModelError(
            path,
            Message(
                "its network sees by {there}, its car by {sensors}",
                there=", ".join(there),
                sensors=", ".join(sorted(car.sensors)),
            ),
            "the metadata that it was trained with",
        )


def _require_same_answers(path: Path, layers: PolicyLayers, function: GraphFunction) -> None:
    """Ask the file's graph, and the one that its layers make up, about noise.

    Raises:
        ForeignModelError: They answer otherwise: the graph computes more than its layers tell.
    """
    noise = np.random.default_rng(0)
    of_layers = GraphFunction(graph_of(layers), output_name(layers.kind))
    for _ in range(ASKED_FRAMES // AT_ONCE):
        fed: dict[str, Array] = {}
        here: dict[str, Array] = {}
        for sensor in layers.network.sensors:
            size = (AT_ONCE, *sensor.shape)
            numbers = (noise.integers(0, 256, size) if sensor.is_image else noise.random(size)).astype(np.float32)
            here[input_name(layers.kind, sensor.name)] = numbers
            fed |= {name: numbers for name in function.inputs if name.rpartition("/")[2] == sensor.name}
        theirs, ours = as_commands(layers.kind, function(fed)), as_commands(layers.kind, of_layers(here))
        difference = float(np.abs(theirs - ours).max()) if theirs.shape == ours.shape else float("inf")
        if not difference <= TOLERANCE:
            raise ForeignModelError(
                path,
                Message("its graph answers otherwise than its layers (by {difference:g})", difference=difference),
                "a network as AWS trains it",
            )
