"""Which files of a folder are a racer's three, under whatever name they came. Begin with `find_racer_files`.

Browsers, mail programs and copies of copies give names like "reward_function (1).py", "Model-Metadata.json" or
"hyperparameters .json.txt". Where the right name is missing, the one file of nearly that name is taken and told of; of
several, none is: which one is meant only their owner knows.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from pathlib import Path

from racecraft.contract.errors import UserInputError
from racecraft.formats.run_folder import HYPERPARAMETERS, MODEL_METADATA, REWARD_FUNCTION

REWARD, METADATA = REWARD_FUNCTION, MODEL_METADATA
PLACES = {
    REWARD: (REWARD,),
    METADATA: (METADATA, f"model/{METADATA}"),
    HYPERPARAMETERS: (HYPERPARAMETERS, f"ip/{HYPERPARAMETERS}"),
}
"""Where each stands by its right name; AWS's model folders keep two of them deeper."""
SHORT_NAMES = {
    REWARD: ("reward", "rewards", "rewardfunc", "rewardfn"),
    METADATA: ("metadata", "modelmeta", "actionspace", "actions"),
    HYPERPARAMETERS: ("hyperparams", "hyperparam", "hyper", "params", "parameters"),
}
"""What racers also call them, letters only."""
NEAR = 0.85
"""Share of letters that two names have in common from which on one is taken for the other."""
_DEFINES_REWARD = re.compile(rb"^\s*def\s+reward_function\s*\(", re.MULTILINE)
_COPY = re.compile(r"(\s*\(\d+\)|[\s_-]+copy[\s_-]*\d*|[\s_-]*v?\d+|\s+)$", re.IGNORECASE)


@dataclass(frozen=True)
class RacerFiles:
    """The racer's files; None where there is none."""

    reward: Path | None = None
    metadata: Path | None = None
    hyperparameters: Path | None = None
    notes: tuple[str, ...] = ()
    """Which names were taken for which, a clause each."""

    @property
    def is_empty(self) -> bool:
        """None of them is there."""
        return self.reward is None and self.metadata is None and self.hyperparameters is None


def find_racer_files(folder: Path) -> RacerFiles:
    """Return which files of a folder are the racer's three.

    Raises:
        UserInputError: Several files may be the one that is missing, and none has the right name.
    """
    notes: list[str] = []
    reward, metadata, hyperparameters = (_find(folder, name, notes) for name in (REWARD, METADATA, HYPERPARAMETERS))
    return RacerFiles(reward, metadata, hyperparameters, tuple(notes))


def _find(folder: Path, name: str, notes: list[str]) -> Path | None:
    near = sorted(path for path in folder.iterdir() if path.is_file() and path.name != name and _is_near(path, name))
    for place in PLACES[name]:
        if (folder / place).exists():
            notes += [
                f"{path.name}: not used, {place} is"
                for path in near
                if _stem_letters(path) == _stem_letters(Path(name))
            ]
            return folder / place
    if len(near) > 1:
        raise UserInputError(
            "{folder}: holds no {name} but {near}; expected one of them "
            "under that name. Rename the one you mean to {name}.",
            folder=folder,
            name=name,
            near=" and ".join(repr(path.name) for path in near),
        )
    notes += [f"{path.name}: taken for {name}" for path in near]
    return near[0] if near else None


def _is_near(path: Path, name: str) -> bool:
    """Tell whether a file may be the one that bears a name."""
    kinds, kind = [suffix.lower() for suffix in path.suffixes], Path(name).suffix
    if kind not in kinds and kinds[-1:] not in ([], [".txt"]):
        return False
    letters = _stem_letters(path)
    if (
        letters in SHORT_NAMES[name]
        or difflib.SequenceMatcher(None, letters, _stem_letters(Path(name))).ratio() >= NEAR
    ):
        return True
    return name == REWARD and kinds[-1:] == [kind] and bool(_DEFINES_REWARD.search(path.read_bytes()))


def _stem_letters(path: Path) -> str:
    """Return the letters of a name, without its kind and the marks of a copy.

    >>> _stem_letters(Path("Reward-Function (1).py")), _stem_letters(Path("hyperparameters .json.txt"))
    ('rewardfunction', 'hyperparameters')
    """
    stem = re.sub(r"(\s*\.(py|json|txt))+$", "", path.name, flags=re.IGNORECASE)
    while (shorter := _COPY.sub("", stem)) != stem:
        stem = shorter
    return "".join(letter for letter in stem.casefold() if letter.isalpha())
