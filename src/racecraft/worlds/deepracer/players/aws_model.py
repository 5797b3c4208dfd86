"""A model of AWS's trainer as a run folder of ours: it drives, is judged, shown, cloned and exported like any other.

Begin with `import_model`. What its files hold is read in `aws_policy.py`. A model is never resumed, for nothing of
its trainer's state is in its files; a new training begins from it with `--from`.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from racecraft.algorithms.architecture import NetworkConfig
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import TrackError, UserInputError
from racecraft.formats.archive import is_archive, without_ending
from racecraft.formats.atomic import OutputFileError, output_error, write_atomic
from racecraft.formats.checkpoint import IMPORTED, Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.files.hyperparameters import read_hyperparameters, write_hyperparameters
from racecraft.worlds.deepracer.files.model_archive import unpack_model
from racecraft.worlds.deepracer.files.model_metadata import (
    ModelMetadata,
    as_aws_dict,
    read_model_metadata,
    write_model_metadata,
)
from racecraft.worlds.deepracer.files.trained_model import (
    ForeignModel,
    ForeignModelError,
    ForeignWeights,
    find_model,
)
from racecraft.worlds.deepracer.files.training_params import ParamsFileError, read_params
from racecraft.worlds.deepracer.players.aws_policy import read_foreign_policy
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.importer import route_file, travels
from racecraft.worlds.deepracer.tracks.track import Track

KIND = "deepracer"
DEFAULT_TRACK = "reinvent_base"


@dataclass(frozen=True)
class Import:
    """What came of an import."""

    run: RunFolder
    checkpoints: tuple[int, ...]
    best: int
    notes: tuple[str, ...]
    """What is worth saying, a clause each."""


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
        UserInputError: Something cannot be used.
    """
    source = Path(source)
    if not is_archive(source):
        return _import(find_model(source, metadata), source, place, track)
    with tempfile.TemporaryDirectory(prefix="racecraft-import-", ignore_cleanup_errors=True) as folder:
        unpack_model(source, folder)
        try:
            found = find_model(folder, metadata)
        except ForeignModelError as error:
            raise type(error)(source, error.found, error.expected, error.hint) from error
        try:
            return _import(found, source, place, track)
        except UserInputError as error:
            if folder not in str(error):
                raise
            named = str(error).replace(f"{folder}{os.sep}", f"{source}: ")  # where it was unpacked is gone by now
            raise UserInputError(named) from error


def _import(model: ForeignModel, source: Path, place: str | Path | None, track: str | None) -> Import:
    car = read_model_metadata(model.metadata)
    circuit, notes = _track_of(model, track)
    metadata = {"model_metadata": as_aws_dict(car), "track": circuit.name}
    with tempfile.TemporaryDirectory(prefix="racecraft-weights-", ignore_cleanup_errors=True) as folder:
        shelved = [
            _write_checkpoint(one, one.iteration == _best_of(model), car, metadata, Path(folder))
            for one in model.weights
        ]
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
            "model_metadata": metadata["model_metadata"],
            "settings": last.settings,
            "notes": notes,
        }  # fmt: skip
        fill = _filler(model, car, circuit, Path(folder))
        if place is None:
            run = RunFolder.create_numbered(Path("runs"), name_of(source), job, fill)
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


def _write_checkpoint(
    weights: ForeignWeights, is_best: bool, car: ModelMetadata, metadata: Mapping[str, Any], folder: Path
) -> _Shelved:
    """Put a state of a model on a shelf; one after the other, for a folder of them is larger than memory."""
    policy = read_foreign_policy(weights, car)
    settings = _settings(car, policy.spec)
    card = {"kind": KIND, "policy_spec": policy.spec.as_dictionary(), **metadata, "settings": settings,
            IMPORTED: list(policy.notes)}  # fmt: skip
    shelf = Checkpoints(folder)
    shelf.save(weights.iteration, weights.steps, policy.weights, card, score=weights.score, best=is_best)
    return _Shelved(policy.spec.algorithm, settings, policy.notes)


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


def _track_of(model: ForeignModel, name: str | None) -> tuple[Track, list[str]]:
    """Return the track a model is to drive, and what is worth saying about it."""
    if name is not None:
        return load_track(name), []
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
            write_atomic(run.reward_function, model.reward.read_bytes())
        if travels(circuit):
            write_atomic(run.track, route_file(circuit))
        try:
            for file in shelf.iterdir():
                shutil.move(file, run.checkpoints / file.name)
        except OSError as error:
            raise OutputFileError(output_error(run.checkpoints, error)) from error

    return fill


def name_of(source: Path) -> str:
    """Return a model's name, from that of its file or folder."""
    name = without_ending(source.resolve().name)
    for end in (".pb", ".ckpt.index", ".ckpt"):
        name = name.removesuffix(end)
    return name or "model"


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value
