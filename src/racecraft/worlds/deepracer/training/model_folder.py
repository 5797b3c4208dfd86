"""A racer's folder: reward function, hyperparameters, metadata; any of the three may be absent."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from racecraft.contract.errors import Faults, UserInputError
from racecraft.formats.run_folder import HYPERPARAMETERS
from racecraft.worlds.deepracer.env.settings import HEAD_TO_BOT, HEAD_TO_MODEL, OBJECT_AVOIDANCE, TIME_TRIAL
from racecraft.worlds.deepracer.files.hyperparameters import Hyperparameters, read_hyperparameters
from racecraft.worlds.deepracer.files.model_metadata import ModelMetadata, default_model_metadata, read_model_metadata
from racecraft.worlds.deepracer.files.racer_files import METADATA, PLACES, REWARD, RacerFiles, find_racer_files
from racecraft.worlds.deepracer.files.reward_analysis import NO_OBJECTS
from racecraft.worlds.deepracer.files.reward_source import RewardSource, read_reward_source

RUN_ENV = "run.env"
EXPECTED = (
    f"expected a folder with {REWARD}, {HYPERPARAMETERS} and {METADATA}, any one of them. `racecraft new FOLDER` makes "
    "one; without a folder, `racecraft train` uses defaults."
)


@dataclass(frozen=True)
class ModelFolder:
    """What a racer brought, and defaults for what is absent."""

    reward: RewardSource | None
    """None: the default reward function."""
    metadata: ModelMetadata
    hyperparameters: Hyperparameters
    notes: tuple[str, ...] = field(default=())
    """What is worth saying: absent files, unknown keys, what does nothing."""


PAID_FOR = {
    TIME_TRIAL: "staying near the centre line",
    OBJECT_AVOIDANCE: "the middle of the lane that the next box leaves free",
    HEAD_TO_BOT: "the middle of the lane that the next bot leaves free",
    HEAD_TO_MODEL: "speed, in the lane that the next car leaves free",
}
"""What a car without a reward function is paid for, by type of race."""
RACING_PAY = "metres gained along the centre line, less for hasty steering and for leaving the road"


def notes_in(model: ModelFolder, race_type: str, is_racing: bool = False) -> list[str]:
    """Return what is worth saying of a racer's files in a race: what is paid by default, and no word of other races."""
    pay = RACING_PAY if is_racing else PAID_FOR[race_type]
    own = [] if model.reward is not None else [f"no {REWARD}: paid for {pay}"]
    return own + [note for note in model.notes if race_type == TIME_TRIAL or NO_OBJECTS not in note]


def read_model_folder(
    folder: Path | None, keys: Mapping[str, Path] | None = None, default: ModelMetadata | None = None
) -> ModelFolder:
    """Read a racer's folder; None stands for no folder at all.

    The two JSON files are also found where AWS's own model folders keep them: `model/` and `ip/`.

    A file of nearly the right name is taken for the one that is missing, and told of.

    Args:
        folder: Where they are looked for.
        keys: Files that were named one by one, by the right name of each; they come first.
        default: The car where there is no model_metadata.json; None: the console's.

    Raises:
        UserInputError: The folder does not exist, holds nothing of a racer's, or files of it cannot be used; all
            faults of all files are in one error.
    """
    if folder is not None and not folder.is_dir():
        what = "is a file" if folder.exists() else "there is no such folder"
        raise UserInputError("{folder}: {what}; {expected}", folder=folder, what=what, expected=EXPECTED)
    files = _found(folder, keys or {})
    if folder is not None and files.is_empty and not (folder / RUN_ENV).is_file():
        raise UserInputError("{folder}: holds none of a racer's files; {expected}", folder=folder, expected=EXPECTED)
    notes, faults = list(files.notes), Faults()
    reward, metadata, given = None, default or default_model_metadata(), Hyperparameters()
    if files.reward is not None:
        with faults.collect():
            reward = read_reward_source(files.reward)
            notes += reward.remarks
    if files.metadata is None:
        notes.append(f"no {METADATA}: {_table(metadata)}")
    else:
        with faults.collect():
            metadata = read_model_metadata(files.metadata)
            notes += [f"{METADATA}: {note}" for note in metadata.notes]
    if files.hyperparameters is None:
        notes.append(f"no {HYPERPARAMETERS}: the preset's values")
    else:
        with faults.collect():
            given = read_hyperparameters(files.hyperparameters)
            notes += [f"{HYPERPARAMETERS}: {note}" for note in given.notes]
    faults.raise_found()
    return ModelFolder(reward, metadata, given, tuple(notes))


def _table(metadata: ModelMetadata) -> str:
    """Return a default table in words.

    >>> _table(default_model_metadata())
    '10 actions, ±30°, ±15°, 0° at 0.5 and 1 m/s'
    """
    angles = sorted({abs(round(math.degrees(one.steering_rad))) for one in metadata.actions}, reverse=True)
    speeds = sorted({one.speed_mps for one in metadata.actions})
    steered = ", ".join(f"±{angle}°" if angle else "0°" for angle in angles)
    return f"{len(metadata.actions)} actions, {steered} at {' and '.join(f'{speed:g}' for speed in speeds)} m/s"


def _found(folder: Path | None, keys: Mapping[str, Path]) -> RacerFiles:
    if folder is None or len(keys) == len(PLACES):
        return RacerFiles(keys.get(REWARD), keys.get(METADATA), keys.get(HYPERPARAMETERS))
    found = find_racer_files(folder)
    return RacerFiles(
        keys.get(REWARD, found.reward),
        keys.get(METADATA, found.metadata),
        keys.get(HYPERPARAMETERS, found.hyperparameters),
        found.notes,
    )
