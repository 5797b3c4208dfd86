"""A model that AWS's trainer made, wherever its files lie: which metadata, which weights. Begin with `find_model`.

Weights are TensorFlow checkpoints (`12_Step-3456.ckpt.index` …) or frozen graphs (`model_12.pb`, `model.pb`); where
there are checkpoints, they are taken, for they hold the critic too. The metadata that lies nearest to them is theirs.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from racecraft.contract.errors import InputFileError, MetadataError
from racecraft.contract.message import Message
from racecraft.formats.run_folder import HYPERPARAMETERS, MODEL_METADATA, REWARD_FUNCTION
from racecraft.worlds.deepracer.files.model_folder import CheckpointMark, read_checkpoint_marks

KIND = "a model of AWS DeepRacer: model_metadata.json with a frozen graph (.pb) or TensorFlow checkpoints (.ckpt)"
MARKS = "deepracer_checkpoints.json"
PARAMS = re.compile(r"training_params(_[\w-]+)?\.ya?ml")
"""The console put the training's id into the name."""
DEEPEST = 5
"""Folders below the one that is named in which files are looked for."""
_CHECKPOINT = re.compile(r"(?:(\d+)_Step-(\d+)|.+)\.ckpt\.index")
_GRAPH = re.compile(r"(?:model(?:_(\d+))?|.+)\.pb")


class ForeignModelError(InputFileError):
    """There is no model of AWS's, or parts of it are missing."""


class NoWeightsError(ForeignModelError):
    """Files of a model are there, and no weights among them."""


@dataclass(frozen=True)
class ForeignWeights:
    """One state of a model."""

    path: Path
    """A frozen graph, or a checkpoint's `.index`."""
    iteration: int
    steps: int
    score: float | None = None
    """What `deepracer_checkpoints.json` says of it, per cent; None: nothing."""

    @property
    def is_graph(self) -> bool:
        """Whether it is a frozen graph, which holds the policy alone."""
        return self.path.suffix == ".pb"


@dataclass(frozen=True)
class ForeignModel:
    """The files of a model."""

    metadata: Path
    weights: tuple[ForeignWeights, ...]
    """By iteration."""
    best: int | None = None
    """Iteration of the best; None: not known."""
    reward: Path | None = None
    hyperparameters: Path | None = None
    params: Path | None = None
    """What the simulator was told."""


def looks_like_aws_model(path: str | Path) -> bool:
    """Tell whether a path may be a model of AWS's: a graph, a checkpoint, or a folder that holds one."""
    path = Path(path)
    if path.is_dir():
        return any(_CHECKPOINT.fullmatch(file.name) or _GRAPH.fullmatch(file.name) for file in _files(path))
    return path.name.endswith((".pb", ".ckpt.index")) or Path(f"{path}.index").is_file()


def find_model(path: str | Path, metadata: str | Path | None = None) -> ForeignModel:
    """Return the files of a model.

    Args:
        path: A folder, a frozen graph, or a checkpoint (`.ckpt`, or its `.index`).
        metadata: A model_metadata.json, where none lies beside.

    Raises:
        NoWeightsError: There are no weights.
        ForeignModelError: There is no metadata.
        CheckpointMarksError: `deepracer_checkpoints.json` is damaged.
    """
    path = Path(path)
    if not path.is_dir():
        return _single(path, metadata)
    files = _files(path)
    weights = _weights(files)
    if not weights:
        has_reward = any(file.name == REWARD_FUNCTION for file in files)
        hint = "`racecraft new FOLDER --files` makes a folder of its files, to be trained anew." if has_reward else ""
        raise NoWeightsError(path, "it holds no weights", KIND, hint)
    named = _nearest(files, {MODEL_METADATA}, weights[-1].path) if metadata is None else Path(metadata)
    if named is None:
        raise ForeignModelError(
            path,
            Message("it holds no {model_metadata}", model_metadata=MODEL_METADATA),
            KIND,
            "Name one with --metadata FILE.",
        )
    marks = _nearest(files, {MARKS}, weights[-1].path)
    best, last = read_checkpoint_marks(marks) if marks is not None else (None, None)
    found = {name: _nearest(files, {name}, weights[-1].path) for name in (REWARD_FUNCTION, HYPERPARAMETERS)}
    return ForeignModel(
        named,
        tuple(_scored(one, best, last) for one in weights),
        best.iteration if best is not None and any(best.iteration == one.iteration for one in weights) else None,
        found[REWARD_FUNCTION],
        found[HYPERPARAMETERS],
        _nearest(files, {file.name for file in files if PARAMS.fullmatch(file.name)}, weights[-1].path),
    )


def _single(path: Path, metadata: str | Path | None) -> ForeignModel:
    """Return the model of one file; its metadata lies beside it, or beside its folder (`agent/model.pb`)."""
    file = path if path.is_file() else Path(f"{path}.index")
    if not file.is_file():
        raise ForeignModelError(path, "there is no such file or folder", KIND)
    weights = _weights([file])
    if not weights:
        raise ForeignModelError(path, "its name is no graph's and no checkpoint's", KIND)
    named = metadata_beside(file) if metadata is None else Path(metadata)
    if named is None:
        raise ForeignModelError(
            path,
            Message("no {model_metadata} lies beside it", model_metadata=MODEL_METADATA),
            "what the car can do, which no weights tell",
            "Put it there, or name it: racecraft import MODEL --metadata FILE.",
        )
    if not named.is_file():
        raise MetadataError(
            named, "there is no such file", Message("a {model_metadata}", model_metadata=MODEL_METADATA)
        )
    return ForeignModel(named, weights)


def metadata_beside(file: Path) -> Path | None:
    """Return the metadata of a model that is one file, beside it or beside its folder; None where there is none."""
    beside = [file.parent / MODEL_METADATA, file.parent.parent / MODEL_METADATA]
    return next((one for one in beside if one.is_file()), None)


def _files(folder: Path) -> list[Path]:
    """Return the files of a folder and those below, shallow ones first; links to folders are not followed."""
    found = []
    for place, folders, names in os.walk(folder):
        depth = len(Path(place).relative_to(folder).parts)
        folders[:] = sorted(folders) if depth < DEEPEST else []
        found += [(depth, Path(place) / name) for name in sorted(names)]
    return [path for _, path in sorted(found, key=lambda pair: pair[0])]


def _weights(files: Iterable[Path]) -> tuple[ForeignWeights, ...]:
    """Return checkpoints by iteration; where there are none, graphs."""
    checkpoints: dict[int, ForeignWeights] = {}
    graphs: dict[int, ForeignWeights] = {}
    for file in files:
        if match := _CHECKPOINT.fullmatch(file.name):
            number = int(match[1] or 0)
            checkpoints.setdefault(number, ForeignWeights(file, number, int(match[2] or 0)))
        elif match := _GRAPH.fullmatch(file.name):
            number = int(match[1] or 0)
            graphs.setdefault(number, ForeignWeights(file, number, 0))
    chosen = checkpoints or graphs
    return tuple(chosen[number] for number in sorted(chosen))


def _nearest(files: Iterable[Path], names: set[str], weights: Path) -> Path | None:
    """Return the file of a name that lies nearest to the weights; of equals, the shallowest."""

    def distance(file: Path) -> tuple[int, int]:
        shared = len(os.path.commonpath([file.parent, weights.parent]))
        return -shared, len(file.parts)

    return min((file for file in files if file.name in names), key=distance, default=None)


def _scored(weights: ForeignWeights, *marks: CheckpointMark | None) -> ForeignWeights:
    for mark in marks:
        if mark is not None and mark.iteration == weights.iteration:
            return ForeignWeights(weights.path, weights.iteration, weights.steps or mark.steps, mark.score)
    return weights
