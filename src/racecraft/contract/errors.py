"""The family of errors: each one a short letter to the person who can act.

::

    RacecraftError                 anything we raise on purpose
    ├── UserInputError             something the user gave; commands end with exit code 2
    │   ├── SettingError           a setting's name or value
    │   ├── InputFileError         a file: says where, what was found, what was expected, what to do
    │   │   ├── TrackError         a track's name or its waypoints
    │   │   ├── MetadataError      model_metadata.json
    │   │   ├── HyperparameterError  hyperparameters.json
    │   │   └── RewardFileError    reward_function.py cannot be loaded
    │   ├── RewardError            the user's reward function failed while training
    │   ├── EnvironmentFailedError the user's environment failed
    │   ├── RunFolderError         a run folder is missing, taken, foreign or damaged
    │   └── MissingExtraError      an optional package is not installed
    └── ContractError              a world or policy broke its promise: a programmer's error

Rooms with errors of their own derive them from this tree.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path


class RacecraftError(Exception):
    """Anything racecraft raises on purpose."""


class UserInputError(RacecraftError):
    """Something the user gave cannot be used; the command line ends with exit code 2."""


class SettingError(UserInputError):
    """A setting has an unknown name or a value outside its range."""


class InputFileError(UserInputError):
    """A user's file cannot be used.

    Args:
        path: The file, as the user named it.
        found: What stands there, with the offending value.
        expected: What should stand there instead.
        cure: What to do about it; may be empty where `expected` says it all.
        line: Line in the file, counted from 1, when known.
        key: Key or column in the file, when known.
    """

    def __init__(
        self,
        path: str | Path,
        found: str,
        expected: str,
        cure: str = "",
        *,
        line: int | None = None,
        key: str | None = None,
    ) -> None:
        self.path = Path(path)
        self.found, self.expected, self.cure = found, expected, cure
        self.line, self.key = line, key
        place = f"{path}" + (f":{line}" if line is not None else "") + (f": {key}" if key else "")
        letter = f"{place}: {found}; expected {expected}."
        super().__init__(f"{letter} {cure}" if cure else letter)


class TrackError(InputFileError):
    """A track name or track file cannot be used."""


class MetadataError(InputFileError):
    """`model_metadata.json` cannot be used."""


class HyperparameterError(InputFileError):
    """`hyperparameters.json` cannot be used."""


class RewardFileError(InputFileError):
    """`reward_function.py` cannot be loaded."""


class RewardError(UserInputError):
    """The user's reward function failed or returned something that is no reward."""


class EnvironmentFailedError(UserInputError):
    """The user's environment failed, or gave something that it did not promise."""


class RunFolderError(UserInputError):
    """A run folder is missing, in use, of another kind, or damaged."""


class MissingExtraError(UserInputError):
    """An optional package is not installed; the message holds the command that installs it."""


class ContractError(RacecraftError):
    """A world or a policy broke its promise."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return a clause that names the nearest known name, the first of several as near, or lists all when none is.

    >>> nearest("horizn", ["horizon", "num_worlds"])
    "Did you mean 'horizon'?"
    >>> nearest("reinvent", ["reinvent_base", "reinvent_wood"])
    "Did you mean 'reinvent_base'?"
    >>> nearest("q", ["left", "right"])
    'Known: left, right.'
    >>> nearest("q", [])
    'There is none.'
    """
    names = list(known)
    if not names:
        return "There is none."
    by_folded_name = {candidate.casefold(): candidate for candidate in names}
    folded = name.casefold()
    likeness = {near: _likeness(near, folded) for near in difflib.get_close_matches(folded, by_folded_name, n=9)}
    alike = [by_folded_name[near] for near, score in likeness.items() if score == max(likeness.values())]
    if alike:
        return f"Did you mean '{min(alike, key=names.index)}'?"
    return f"Known: {', '.join(names)}."


def _likeness(name: str, other: str) -> float:
    return difflib.SequenceMatcher(None, name, other).ratio()
