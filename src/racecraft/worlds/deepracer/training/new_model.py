"""A folder to begin with: reward function, hyperparameters, metadata and a page that explains them."""

from __future__ import annotations

import inspect
from pathlib import Path

from racecraft.contract.errors import SettingError, UserInputError, nearest
from racecraft.contract.extensions import load_offered, offered
from racecraft.formats.atomic import write_atomic
from racecraft.worlds.deepracer.files.model_metadata import racing_model_metadata, write_model_metadata
from racecraft.worlds.deepracer.files.reward_file import racing_reward_source
from racecraft.worlds.deepracer.files.reward_samples import read_sample, sample_names

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
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        what = "is not empty" if folder.is_dir() else "is a file"
        raise UserInputError(
            "{folder}: {what}; expected a new or empty folder. Choose another name.", folder=folder, what=what
        )
    source = racing_reward_source() if reward is None else _offered_reward(reward)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserInputError(
            "{folder}: cannot be made ({strerror}); expected a place you may write to.",
            folder=folder,
            strerror=error.strerror,
        ) from error
    write_atomic(folder / "reward_function.py", source)
    write_atomic(folder / "hyperparameters.json", HYPERPARAMETERS)
    write_model_metadata(racing_model_metadata(), folder / "model_metadata.json")
    write_atomic(folder / "README.md", README.format(name=folder.name))
    return [
        folder / name for name in ("reward_function.py", "model_metadata.json", "hyperparameters.json", "README.md")
    ]


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
