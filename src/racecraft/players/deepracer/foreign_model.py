"""A model of AWS's trainer as a run folder of ours: it drives, is judged, shown, cloned and exported like any other.

Begin with `import_model`. Weights are read by our own small readers; where the file tells the graph as well, the graph
itself answers beside the network that was made of it, and what disagrees is refused. A model is never resumed, for
nothing of its trainer's state is in its files; a new training begins from it with `--from`.
"""

from __future__ import annotations

import atexit
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.algorithms.architecture import NetworkConfig
from racecraft.algorithms.plain_layers import ForeignPolicy, policy_of
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import TrackError
from racecraft.contract.world import ArraySpec
from racecraft.envs.deepracer.actions import action_space
from racecraft.envs.deepracer.sensors import STEREO, car_sensors
from racecraft.envs.deepracer.settings import CameraConfig, RaceConfig
from racecraft.envs.deepracer.world import world_spec
from racecraft.formats.aws.hyperparameters import read_hyperparameters, write_hyperparameters
from racecraft.formats.aws.model_archive import is_archive, unpack_model
from racecraft.formats.aws.model_metadata import (
    ModelMetadata,
    as_aws_dict,
    read_model_metadata,
    write_model_metadata,
)
from racecraft.formats.aws.policy_graph import (
    as_commands,
    bare_lidars_in,
    graph_of,
    input_name,
    output_name,
    policy_output_in,
    read_policy_graph,
    strides_in,
)
from racecraft.formats.aws.policy_layers import IMAGE, PolicyLayers, PolicyLayersError
from racecraft.formats.aws.policy_weights import is_of_policy, layers_from
from racecraft.formats.aws.trained_model import (
    ForeignModel,
    ForeignModelError,
    ForeignWeights,
    find_model,
    looks_foreign,
)
from racecraft.formats.aws.training_params import ParamsFileError, read_params
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import JOB, RunFolder
from racecraft.formats.tensorflow.arithmetic import GraphArithmeticError, GraphFunction
from racecraft.formats.tensorflow.checkpoint import INDEX, read_checkpoint
from racecraft.formats.tensorflow.graph import read_meta_graph
from racecraft.formats.whole import OutputFileError, output_letter, write_whole
from racecraft.tracks.catalogue import load_track
from racecraft.tracks.importer import route_file, travels
from racecraft.tracks.track import Track

KIND = "deepracer"
DEFAULT_TRACK = "reinvent_base"
ASKED_FRAMES = 8
TOLERANCE = 1e-4
"""How far answers of graph and network may lie apart."""
IMPORTED = "imported"
"""What job.json holds of a run that was imported: where from."""


@dataclass(frozen=True)
class Import:
    """What came of an import."""

    run: RunFolder
    checkpoints: tuple[int, ...]
    best: int
    notes: tuple[str, ...]
    """What is worth saying, a clause each."""


def is_foreign(path: str | Path) -> bool:
    """Tell whether a path is no run of ours but may be a model of AWS's: archive, folder, graph or checkpoint."""
    path = Path(path)
    return not (path / JOB).is_file() and (is_archive(path) or looks_foreign(path))


def import_model(
    source: str | Path,
    place: str | Path | None = None,
    metadata: str | Path | None = None,
    track: str | None = None,
) -> Import:
    """Make a run folder of a model.

    Args:
        source: An archive, a model folder, a frozen graph or a checkpoint.
        place: The new run folder; None: the next free `runs/<name>-<number>`.
        metadata: A model_metadata.json, where none lies beside the weights.
        track: What it drives unless told otherwise; None: what its training_params.yaml names, or reinvent_base.

    Raises:
        UserInputError: Whatever cannot be used, as a letter.
    """
    source = Path(source)
    if not is_archive(source):
        return _import(find_model(source, metadata), source, place, track)
    with tempfile.TemporaryDirectory(prefix="racecraft-import-") as folder:
        unpack_model(source, folder)
        try:
            found = find_model(folder, metadata)
        except ForeignModelError as error:
            raise ForeignModelError(source, error.found, error.expected, error.cure) from error
        return _import(found, source, place, track)


def borrowed_run(source: str | Path) -> RunFolder:
    """Return a model of AWS's as a run folder that lives as long as this process; a run of ours is opened as it is.

    Raises:
        UserInputError: Whatever cannot be used, as a letter.
    """
    if not is_foreign(source):
        return RunFolder.open(source)
    folder = tempfile.mkdtemp(prefix="racecraft-model-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return import_model(source, Path(folder) / _name_of(Path(source))).run


def _import(model: ForeignModel, source: Path, place: str | Path | None, track: str | None) -> Import:
    car = read_model_metadata(model.metadata)
    circuit, notes = _track_of(model, track)
    told = {"model_metadata": as_aws_dict(car), "track": circuit.name}
    with tempfile.TemporaryDirectory(prefix="racecraft-weights-") as folder:
        shelved = [_shelve(one, one.iteration == _best_of(model), car, told, Path(folder)) for one in model.weights]
        last = shelved[-1]
        notes = list(dict.fromkeys([*car.notes, *notes, *last.notes]))
        job = {
            "kind": KIND,
            "title": f"{circuit.title or circuit.name}, {source.name}",
            "algorithm": last.algorithm,
            "asked": {"track": circuit.name, "preset": "aws", "set": [], "stops": [], "folder": None,
                      "from": source.name},
            IMPORTED: source.name,
            "track": {
                "name": circuit.name,
                "hash": circuit.hash(),
                "length_m": circuit.length,
                "copy": "track.npy" if travels(circuit) else None,
            },
            "evaluate": {},
            "env": {},
            "model_metadata": told["model_metadata"],
            "settings": last.settings,
            "notes": notes,
        }  # fmt: skip
        fill = _filler(model, car, circuit, Path(folder))
        if place is None:
            run = RunFolder.create_numbered(Path("runs"), _name_of(source), job, fill)
        else:
            run = RunFolder.create(place, job, fill)
    return Import(run, tuple(one.iteration for one in model.weights), _best_of(model), tuple(notes))


def _best_of(model: ForeignModel) -> int:
    return model.best if model.best is not None else model.weights[-1].iteration


@dataclass(frozen=True)
class _Shelved:
    """What is to be remembered of a state of a model whose weights lie on the shelf."""

    algorithm: str
    settings: dict[str, Any]
    notes: tuple[str, ...]


def _shelve(
    weights: ForeignWeights, is_best: bool, car: ModelMetadata, told: Mapping[str, Any], folder: Path
) -> _Shelved:
    """Put a state of a model on a shelf; one after the other, for a folder of them is larger than memory."""
    policy = _policy(weights, car)
    settings = _settings(car, policy.spec)
    card = {"kind": KIND, "policy_spec": policy.spec.as_dictionary(), **told, "settings": settings,
            IMPORTED: list(policy.notes)}  # fmt: skip
    shelf = Checkpoints(folder)
    shelf.save(weights.iteration, weights.steps, policy.weights, card, score=weights.score, best=is_best)
    return _Shelved(policy.spec.algorithm, settings, policy.notes)


def _policy(weights: ForeignWeights, car: ModelMetadata) -> ForeignPolicy:
    """Return the policy of a state of a model, having asked its graph beside its layers where there is one."""
    try:
        layers, function, notes = _read(weights)
        _require_named_sensors(weights.path, layers, car)
        if function is not None:
            _require_same_answers(weights.path, layers, function)
    except GraphArithmeticError as error:
        raise GraphArithmeticError(f"{weights.path}: {error}") from error
    try:
        policy = policy_of(layers, _observations(car, layers), action_space(car.action_space).spec)
    except PolicyLayersError as error:
        raise _model_letter(weights.path, error) from error
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
        raise _model_letter(weights.path, error) from error


def _model_letter(path: Path, error: PolicyLayersError) -> ForeignModelError:
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
        ForeignModelError: The letter names both.
    """
    there = [sensor.name for sensor in layers.network.sensors]
    one_eyed = len(there) == 1 == len(car.sensors) and STEREO not in (*there, *car.sensors)
    if not one_eyed and there != sorted(car.sensors):
        raise ForeignModelError(
            path, f"its network sees by {', '.join(there)}, its car by {', '.join(sorted(car.sensors))}",
            "the metadata that it was trained with",
        )  # fmt: skip


def _require_same_answers(path: Path, layers: PolicyLayers, function: GraphFunction) -> None:
    """Ask the file's graph, and the one that its layers make up, about noise.

    Raises:
        ForeignModelError: They answer otherwise: the graph computes more than its layers tell.
    """
    noise = np.random.default_rng(0)
    fed, here = {}, {}
    for sensor in layers.network.sensors:
        numbers = (
            noise.integers(0, 256, (ASKED_FRAMES, *sensor.shape))
            if sensor.is_image
            else noise.random((ASKED_FRAMES, *sensor.shape))
        )
        here[input_name(layers.kind, sensor.name)] = numbers.astype(np.float32)
        for name in function.inputs:
            if name.rpartition("/")[2] == sensor.name:
                fed[name] = numbers.astype(np.float32)
    told = as_commands(layers.kind, function(fed))
    ours = as_commands(layers.kind, GraphFunction(graph_of(layers), output_name(layers.kind))(here))
    difference = float(np.abs(told - ours).max()) if told.shape == ours.shape else float("inf")
    if not difference <= TOLERANCE:
        raise ForeignModelError(
            path, f"its graph answers otherwise than its layers (by {difference:g})", "a network as AWS trains it"
        )


def _settings(car: ModelMetadata, spec: PolicySpec) -> dict[str, Any]:
    """Return the groups of settings that such a training would have had."""
    row = spec.network
    filters, kernels, strides = (tuple(part[place] for part in row["convolutions"]) for place in range(3))
    network = NetworkConfig(
        conv_filters=filters,
        conv_kernels=kernels,
        conv_strides=strides,
        image_units=tuple(row["image_units"]) or None,
        vector_units=tuple(row["vector_units"]) or None,
        hidden_units=tuple(row["trunk_units"]),
        activation=row["activation"],
        privileged_critic=False,
        separate_networks=True,
        initialisation="glorot",
    )
    height, width = next(part.shape[:2] for part in spec.visible.values() if len(part.shape) > 1)
    camera = CameraConfig(width=width, height=height, light="2019" if car.version in ("1", "2") else "car")
    groups: dict[str, Any] = {"race": RaceConfig(car=car.car, fidelity="aws"), "camera": camera, "network": network}
    return {name: {key: _plain(value) for key, value in asdict(group).items()} for name, group in groups.items()}


def _track_of(model: ForeignModel, asked: str | None) -> tuple[Track, list[str]]:
    """Return the track a model is to drive, and what is worth saying about it."""
    if asked is not None:
        return load_track(asked), []
    named = None
    try:
        named = None if model.params is None else read_params(model.params).get("WORLD_NAME")
    except ParamsFileError as error:
        return load_track(DEFAULT_TRACK), [f"{error}; {DEFAULT_TRACK} is taken"]
    if not isinstance(named, str):
        return load_track(DEFAULT_TRACK), [f"nothing says what it was trained on; {DEFAULT_TRACK} is taken"]
    try:
        return load_track(named), []
    except TrackError:
        return load_track(DEFAULT_TRACK), [f"its track {named!r} is not known here; {DEFAULT_TRACK} is taken"]


def _filler(model: ForeignModel, car: ModelMetadata, circuit: Track, shelf: Path) -> Callable[[RunFolder], None]:
    def fill(run: RunFolder) -> None:
        write_model_metadata(car, run.model_metadata)
        if model.hyperparameters is not None:
            write_hyperparameters(read_hyperparameters(model.hyperparameters), run.hyperparameters)
        if model.reward is not None:
            write_whole(run.reward_function, model.reward.read_bytes())
        if travels(circuit):
            write_whole(run.track, route_file(circuit))
        try:
            for file in shelf.iterdir():
                shutil.move(file, run.checkpoints / file.name)
        except OSError as error:
            raise OutputFileError(output_letter(run.checkpoints, error)) from error

    return fill


def _name_of(source: Path) -> str:
    """Return a model's name, from that of its file or folder."""
    name = source.resolve().name
    for end in (".tar.gz", ".tgz", ".tar", ".zip", ".pb", ".ckpt.index", ".ckpt"):
        name = name.removesuffix(end)
    return name or "model"


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
