"""The family of errors: each one a short letter to the person who can act.

::

    RacecraftError                 anything we raise on purpose
    ├── UserInputError             something the user gave; commands end with exit code 2
    │   ├── SeveralFaultsError     several of the following, reported together
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

import contextlib
import difflib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

MAX_SHOWN_FAULTS = 20
MAX_SHOWN_CHARACTERS = 300
"""Of what stands in a user's file; a value may be as long as the file."""


class RacecraftError(Exception):
    """Anything racecraft raises on purpose."""


class UserInputError(RacecraftError):
    """Something the user gave cannot be used; the command line ends with exit code 2."""


class SeveralFaultsError(UserInputError):
    """Several things cannot be used; the message holds a line for each.

    Args:
        faults: The errors, in the order in which they were found.
    """

    def __init__(self, faults: Sequence[UserInputError]) -> None:
        self.faults = tuple(faults)
        lines = [f"  {fault}" for fault in self.faults[:MAX_SHOWN_FAULTS]]
        if len(self.faults) > MAX_SHOWN_FAULTS:
            lines.append(f"  and {len(self.faults) - MAX_SHOWN_FAULTS} more")
        super().__init__("\n".join([f"{len(self.faults)} faults:", *lines]))


class Faults:
    """Collects errors of the user's input, so that they are reported together."""

    def __init__(self) -> None:
        self.found: list[UserInputError] = []

    @contextlib.contextmanager
    def collect(self) -> Iterator[None]:
        """Keep an error that is raised inside, and go on behind."""
        try:
            yield
        except SeveralFaultsError as error:
            self.found += error.faults
        except UserInputError as error:
            self.found.append(error)

    def error(self) -> UserInputError:
        """Return the only error that was collected, or one that holds them all."""
        return self.found[0] if len(self.found) == 1 else SeveralFaultsError(self.found)

    def raise_found(self) -> None:
        """Raise what was collected; do nothing where there is none.

        Raises:
            UserInputError: The only error.
            SeveralFaultsError: All of them, where there are several.
        """
        if self.found:
            raise self.error()


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
        place = f"{path}" + (f":{line}" if line is not None else "") + (f": {shortened(key)}" if key else "")
        letter = f"{place}: {shortened(found)}; expected {expected}."
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


def shortened(text: str, most: int = MAX_SHOWN_CHARACTERS) -> str:
    r"""Return a text with its middle left out where it is long, and with what no terminal can show escaped.

    >>> shortened("a" * 1000, 9), shortened("half " + chr(0xD83D))
    ('aaaa…aaaa', 'half \\ud83d')
    """
    if len(text) > most:
        text = f"{text[: most // 2]}…{text[-(most // 2) :]}"
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


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
