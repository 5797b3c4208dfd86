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

from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.plain_layers import ForeignPolicy, policy_of
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.registry import find_algorithm
from racecraft.algorithms.weights import to_tensors
from racecraft.contract.errors import TrackError
from racecraft.contract.world import Array, ArraySpec
from racecraft.envs.deepracer.actions import action_space
from racecraft.envs.deepracer.settings import CameraConfig, RaceConfig
from racecraft.envs.deepracer.world import CAMERA_NAME, world_spec
from racecraft.formats.aws.hyperparameters import read_hyperparameters, write_hyperparameters
from racecraft.formats.aws.model_archive import is_archive, unpack_model
from racecraft.formats.aws.model_metadata import (
    ModelMetadata,
    as_aws_dict,
    read_model_metadata,
    write_model_metadata,
)
from racecraft.formats.aws.policy_graph import policy_output_in, read_policy_graph, strides_in
from racecraft.formats.aws.policy_layers import DISCRETE, IMAGE, SAC, PolicyLayers, PolicyLayersError, layers_from
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
from racecraft.formats.whole import write_whole
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
    _require_one_camera(car, model.metadata)
    circuit, notes = _track_of(model, track)
    policies: dict[int, tuple[ForeignWeights, ForeignPolicy]] = {}
    for one in model.weights:  # by iteration; of the layers only the last ones are kept, for memory's sake
        layers, last = _policy(one, car)
        policies[one.iteration] = one, last
    notes = list(dict.fromkeys([*car.notes, *notes, *last.notes]))
    settings = _settings(car, layers, last)
    told = {"model_metadata": as_aws_dict(car), "track": circuit.name}
    job = {
        "kind": KIND,
        "title": f"{circuit.title or circuit.name}, {source.name}",
        "algorithm": last.spec.algorithm,
        "asked": {"track": circuit.name, "preset": "aws", "set": [], "stops": [], "folder": None, "from": source.name},
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
        "settings": settings,
        "notes": notes,
    }
    fill = _filler(model, car, circuit)
    if place is None:
        run = RunFolder.create_numbered(Path("runs"), _name_of(source), job, fill)
    else:
        run = RunFolder.create(place, job, fill)
    best = model.best if model.best is not None else max(policies)
    shelf = Checkpoints(run.checkpoints)
    for number, (one, policy) in policies.items():
        card = {"kind": KIND, "policy_spec": policy.spec.as_dictionary(), **told, "settings": settings,
                IMPORTED: list(policy.notes)}  # fmt: skip
        shelf.save(number, one.steps, policy.weights, card, score=one.score, best=number == best)
    return Import(run, tuple(policies), best, tuple(notes))


def _policy(weights: ForeignWeights, car: ModelMetadata) -> tuple[PolicyLayers, ForeignPolicy]:
    """Return the policy of a state of a model, having asked its graph beside it where there is one."""
    layers, function, notes = _read(weights)
    try:
        policy = policy_of(layers, _observations(car, layers), action_space(car.action_space).spec)
    except PolicyLayersError as error:
        found, _, expected = str(error).partition("; expected ")
        raise ForeignModelError(weights.path, found, expected.rstrip(".") or "AWS's layers") from error
    if function is not None:
        _require_same_answers(weights.path, layers, function, policy)
    return layers, ForeignPolicy(policy.spec, policy.weights, (*policy.notes, *notes))


def _read(weights: ForeignWeights) -> tuple[PolicyLayers, GraphFunction | None, tuple[str, ...]]:
    """Return a file's layers, and its graph as a function where it tells one that we can compute."""
    if weights.is_graph:
        return (*read_policy_graph(weights.path), ())
    arrays = read_checkpoint(weights.path)
    meta = Path(str(weights.path).removesuffix(INDEX) + ".meta")
    strides: Mapping[str, int] = {}
    function: GraphFunction | None = None
    notes: tuple[str, ...] = ()
    try:
        if meta.is_file():
            graph = read_meta_graph(meta)
            strides = strides_in(graph)
            function = GraphFunction(graph, policy_output_in(graph, meta), arrays)
    except GraphArithmeticError as error:
        notes = (f"{meta.name} was not asked beside the network: {error}",)
    try:
        return layers_from(arrays, strides), function, notes
    except PolicyLayersError as error:
        found, _, expected = str(error).partition("; expected ")
        raise ForeignModelError(weights.path, found, expected.rstrip(".") or "AWS's layers") from error


def _observations(car: ModelMetadata, layers: PolicyLayers) -> dict[str, ArraySpec]:
    shrink = max(sensor.shrink for sensor in layers.network.sensors)
    camera = CameraConfig(width=IMAGE[1] // shrink, height=IMAGE[0] // shrink)
    return dict(world_spec(action_space(car.action_space), camera).observations)


def _require_same_answers(path: Path, layers: PolicyLayers, function: GraphFunction, policy: ForeignPolicy) -> None:
    """Ask graph and network about frames of noise.

    Raises:
        ForeignModelError: They answer otherwise: the graph computes more than its layers tell.
    """
    frames = np.random.default_rng(0).integers(0, 256, (ASKED_FRAMES, *IMAGE, 1), dtype=np.uint8)
    sensor = layers.network.sensors[0]
    told = function(dict.fromkeys(function.inputs, frames))
    squares = frames.reshape(ASKED_FRAMES, IMAGE[0] // sensor.shrink, sensor.shrink, -1, sensor.shrink)
    seen = squares.mean(axis=(2, 4), dtype=np.float32) / np.float32(255.0)
    here = _answers(policy.spec, policy.weights, {CAMERA_NAME: seen}, layers.kind)
    if layers.kind != DISCRETE:
        told = np.tanh(told) if layers.kind == SAC else np.clip(told, -1.0, 1.0)
    difference = float(np.abs(told - here).max()) if told.shape == here.shape else float("inf")
    if not difference <= TOLERANCE:
        raise ForeignModelError(
            path, f"its graph answers otherwise than its layers (by {difference:g})", "a network as AWS trains it"
        )


def _answers(spec: PolicySpec, weights: Mapping[str, Array], seen: Mapping[str, Array], kind: str) -> Array:
    """Return what a policy answers: likelihoods of choices, or numbers in [-1, 1] units."""
    policy: Any = find_algorithm(spec.algorithm).learner_class().load_policy(spec, to_tensors(dict(weights)))
    if kind == DISCRETE:
        return np.asarray(policy.probabilities(seen))
    bounds: Any = spec.actions
    low, high = np.asarray(bounds.low), np.asarray(bounds.high)
    return np.asarray(2.0 * (policy.act(seen) - low) / (high - low) - 1.0)


def _settings(car: ModelMetadata, layers: PolicyLayers, policy: ForeignPolicy) -> dict[str, Any]:
    """Return the groups of settings that such a training would have had."""
    row, shrink = policy.spec.network, layers.network.sensors[0].shrink
    filters, kernels, strides = ([part[place] for part in row["convolutions"]] for place in range(3))
    network = NetworkConfig(
        tuple(filters), tuple(kernels), tuple(strides), tuple(row["image_units"]) or None, tuple(row["trunk_units"]),
        activation=row["activation"], privileged_critic=False, separate_networks=True, initialisation="glorot",
    )  # fmt: skip
    camera = CameraConfig(
        width=IMAGE[1] // shrink, height=IMAGE[0] // shrink, light="2019" if car.version in ("1", "2") else "car"
    )
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


def _require_one_camera(car: ModelMetadata, path: Path) -> None:
    """Refuse a car that sees with more than one eye: its networks have inputs that are not mapped yet.

    Raises:
        ForeignModelError: It carries a pair of cameras, or a LiDAR.
    """
    if len(car.sensors) > 1 or car.sensors[0] == "STEREO_CAMERAS":
        raise ForeignModelError(
            path, f"its car sees with {', '.join(car.sensors)}", "one camera of one eye; others are not imported yet"
        )


def _filler(model: ForeignModel, car: ModelMetadata, circuit: Track) -> Callable[[RunFolder], None]:
    def fill(run: RunFolder) -> None:
        write_model_metadata(car, run.model_metadata)
        if model.hyperparameters is not None:
            write_hyperparameters(read_hyperparameters(model.hyperparameters), run.hyperparameters)
        if model.reward is not None:
            write_whole(run.reward_function, model.reward.read_bytes())
        if travels(circuit):
            write_whole(run.track, route_file(circuit))

    return fill


def _name_of(source: Path) -> str:
    """Return a model's name, from that of its file or folder."""
    name = source.resolve().name
    for end in (".tar.gz", ".tgz", ".tar", ".zip", ".pb", ".ckpt.index", ".ckpt"):
        name = name.removesuffix(end)
    return name or "model"


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
