"""A racer's folder: reward function, hyperparameters, metadata; any of the three may be absent."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from racecraft.contract.errors import UserInputError
from racecraft.formats.aws.hyperparameters import Hyperparameters, read_hyperparameters
from racecraft.formats.aws.model_metadata import (
    ModelMetadata,
    default_model_metadata,
    read_model_metadata,
    refuse_unbuilt,
)

REWARD, METADATA, HYPERPARAMETERS = "reward_function.py", "model_metadata.json", "hyperparameters.json"


@dataclass(frozen=True)
class ModelFolder:
    """What a racer brought, and defaults for what is absent."""

    reward_path: Path | None
    """None: the default reward function."""
    metadata: ModelMetadata
    hyperparameters: Hyperparameters
    notes: tuple[str, ...] = field(default=())
    """What is worth saying: absent files, unknown keys, what does nothing."""


def read_model_folder(folder: Path | None) -> ModelFolder:
    """Read a racer's folder; None stands for no folder at all.

    The two JSON files are also found where AWS's own model folders keep them: `model/` and `ip/`.

    Raises:
        UserInputError: The folder does not exist, or one of its files cannot be used.
    """
    if folder is not None and not folder.is_dir():
        what = "is a file" if folder.exists() else "there is no such folder"
        raise UserInputError(
            f"{folder}: {what}; expected a folder with {REWARD}, {HYPERPARAMETERS} and {METADATA}. "
            "`racecraft new FOLDER` makes one."
        )
    notes: list[str] = []
    reward = _find(folder, (REWARD,))
    metadata_path = _find(folder, (METADATA, f"model/{METADATA}"))
    hyperparameters_path = _find(folder, (HYPERPARAMETERS, f"ip/{HYPERPARAMETERS}"))
    if reward is None:
        notes.append(f"no {REWARD}: paid for staying near the centre line")
    metadata = default_model_metadata()
    if metadata_path is None:
        notes.append(f"no {METADATA}: {len(metadata.actions)} actions, ±30°, ±15°, 0° at 0.5 and 1 m/s")
    else:
        metadata = read_model_metadata(metadata_path)
        notes += [f"{METADATA}: {note}" for note in metadata.notes]
        refuse_unbuilt(metadata, metadata_path)
    given = Hyperparameters()
    if hyperparameters_path is None:
        notes.append(f"no {HYPERPARAMETERS}: the preset's values")
    else:
        given = read_hyperparameters(hyperparameters_path)
        notes += [f"{HYPERPARAMETERS}: {note}" for note in given.notes]
    return ModelFolder(reward, metadata, given, tuple(notes))


def _find(folder: Path | None, names: tuple[str, ...]) -> Path | None:
    if folder is None:
        return None
    return next((folder / name for name in names if (folder / name).exists()), None)
