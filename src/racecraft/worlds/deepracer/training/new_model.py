"""A folder to begin with: reward function, hyperparameters, metadata and a page that explains them."""

from __future__ import annotations

import inspect
import os
import tempfile
from pathlib import Path

from racecraft.contract.errors import SettingError, UserInputError, nearest
from racecraft.contract.extensions import load_offered, offered
from racecraft.formats.archive import is_archive
from racecraft.formats.atomic import write_atomic
from racecraft.formats.run_folder import HYPERPARAMETERS as HYPERPARAMETERS_FILE
from racecraft.worlds.deepracer.files.model_archive import unpack_model
from racecraft.worlds.deepracer.files.model_metadata import racing_model_metadata, write_model_metadata
from racecraft.worlds.deepracer.files.racer_files import METADATA, REWARD, RacerFiles, find_racer_files
from racecraft.worlds.deepracer.files.reward_file import racing_reward_source
from racecraft.worlds.deepracer.files.reward_samples import read_sample, sample_names
from racecraft.worlds.deepracer.files.trained_model import ForeignModelError
from racecraft.worlds.deepracer.training.model_folder import read_model_folder

HYPERPARAMETERS = """\
{
  "lr": 0.001,
  "discount_factor": 0.97,
  "num_epochs": 4,
  "batch_size": 256,
  "beta_entropy": 0.003,
  "loss_type": "mean squared error"
}
"""

README = """\
# A car of your own

Three files make a car; all three are the files AWS DeepRacer knows, so they travel both ways.

| file | what it says |
|---|---|
| `reward_function.py` | what the car is paid for, 15 times a second; the place where your ideas go |
| `model_metadata.json` | what the car can do: pairs of steering angle (degrees, positive left) and speed (m/s) |
| `hyperparameters.json` | how it learns; any line may be deleted, and a default is then used and named |

Train it, from the folder that holds this one:

    racecraft train {name}
    racecraft evaluate runs/reinvent_base-1 --video lap.mp4

Things to try first:

1. Print something in `reward_function`: it lands in `log.txt` of the run.
2. Change what steering costs (0.25), and look at lap time and steering: `racecraft evaluate` prints both.
3. Give the car faster actions in `model_metadata.json`, up to 4 m/s.
4. Another track: `racecraft tracks list`, then `racecraft train {name} --track Oval_track`.

Every parameter the reward function is given is listed in the documentation under *The reward function*.
"""


def new_model(folder: Path, reward: str | None = None) -> list[Path]:
    """Write the four files into a new or empty folder and return their paths.

    Args:
        folder: The folder.
        reward: Name of a reward function that an installed package offers; None: the example.

    Raises:
        SettingError: No package offers such a reward function.
        UserInputError: The folder holds something already, or cannot be made.
    """
    source = racing_reward_source() if reward is None else _offered_reward(reward)
    _make_empty(folder)
    write_atomic(folder / "reward_function.py", source)
    write_atomic(folder / "hyperparameters.json", HYPERPARAMETERS)
    write_model_metadata(racing_model_metadata(), folder / "model_metadata.json")
    write_atomic(folder / "README.md", README.format(name=folder.name))
    return [
        folder / name for name in ("reward_function.py", "model_metadata.json", "hyperparameters.json", "README.md")
    ]


def model_of_files(folder: Path, source: Path) -> tuple[list[Path], list[str]]:
    """Copy a racer's files into a new or empty folder, under the names that a training reads.

    Args:
        folder: The folder.
        source: An archive, a folder, or a reward function (.py); the racer's files may lie in a folder within it.

    Returns:
        The paths that were written, and what is worth saying: what is missing and which default is taken.

    Raises:
        ForeignModelError: There is no reward function.
        UserInputError: A file cannot be used, or the folder holds something already.
    """
    if not is_archive(source):
        return _copy_files(folder, source, source)
    with tempfile.TemporaryDirectory(prefix="racecraft-new-", ignore_cleanup_errors=True) as unpacked:
        unpack_model(source, unpacked)
        try:
            return _copy_files(folder, Path(unpacked), source)
        except UserInputError as error:
            if unpacked not in str(error):
                raise
            raise UserInputError(str(error).replace(f"{unpacked}{os.sep}", f"{source}: ")) from error


def _copy_files(folder: Path, place: Path, source: Path) -> tuple[list[Path], list[str]]:
    """Copy the racer's files that lie in a place; errors call it by `source`."""
    places = [place, *sorted(path for path in place.rglob("*") if path.is_dir())] if place.is_dir() else []
    found = (find_racer_files(one) for one in sorted(places, key=lambda one: len(one.parts)))
    files = RacerFiles(place) if place.suffix == ".py" else next((one for one in found if one.reward), RacerFiles())
    if files.reward is None or not files.reward.is_file():
        raise ForeignModelError(source, "it holds no reward_function.py", "a racer's files, that one among them")
    named = {REWARD: files.reward, METADATA: files.metadata, HYPERPARAMETERS_FILE: files.hyperparameters}
    keys = {name: path for name, path in named.items() if path is not None}
    notes = [*files.notes, *read_model_folder(None, keys).notes]
    _make_empty(folder)
    for name, path in keys.items():
        write_atomic(folder / name, path.read_bytes())
    return [folder / name for name in keys], notes


def _make_empty(folder: Path) -> None:
    """Make a folder that is not there or is empty.

    Raises:
        UserInputError: It holds something already, or cannot be made.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        what = "is not empty" if folder.is_dir() else "is a file"
        raise UserInputError(
            "{folder}: {what}; expected a new or empty folder. Choose another name.", folder=folder, what=what
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserInputError(
            "{folder}: cannot be made ({strerror}); expected a place you may write to.",
            folder=folder,
            strerror=error.strerror,
        ) from error


def _offered_reward(name: str) -> str:
    """Return the text of a sample, or of the module that an installed package offers as a reward function.

    Raises:
        SettingError: There is no such sample and no package offers one, or it cannot be imported.
    """
    if name in sample_names():
        return read_sample(name)
    module = load_offered("rewards", name)
    if module is None:
        raise SettingError(
            "--reward is {name!r}; expected a sample or one of an installed package. {hint}",
            name=name,
            hint=nearest(name, [*sample_names(), *offered("rewards")]),
        )
    return inspect.getsource(module)
