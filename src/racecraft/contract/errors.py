"""All errors of racecraft. An error is data: its kind, a message and named fields.

Its text is made where it is shown: a terminal, `--json`, a page. A message says what was found, what was expected and
what to do, to the person who can act.

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

Packages derive their own errors from these.
"""

from __future__ import annotations

import contextlib
import difflib
import functools
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from racecraft.contract.message import Message, shortened

MAX_SHOWN_FAULTS = 20


class RacecraftError(Exception):
    """Anything racecraft raises on purpose.

    >>> error = SettingError("horizon is {found}; expected {expected}.", found=0, expected="1 or more")
    >>> print(error)
    horizon is 0; expected 1 or more.
    >>> error.as_data()["kind"], error.as_data()["fields"]
    ('SettingError', {'found': 0, 'expected': '1 or more'})

    Args:
        message: A template in English, as `Message` takes it, or a message.
        fields: What stands in the template, by name.
    """

    def __init__(self, message: str | Message = "", /, **fields: Any) -> None:
        self.message = message if isinstance(message, Message) else Message(message, **fields)
        super().__init__(self.message)

    def __str__(self) -> str:
        return str(self.message)

    def as_data(self) -> dict[str, Any]:
        """Return kind, text, template and fields as JSON takes them."""
        return {"kind": type(self).__name__, **self.message.as_data(), "message": str(self)}


class UserInputError(RacecraftError):
    """Something the user gave cannot be used; the command line ends with exit code 2."""


class SeveralFaultsError(UserInputError):
    """Several things cannot be used; the message holds a line for each.

    Args:
        faults: The errors, in the order in which they were found.
    """

    def __init__(self, faults: Sequence[UserInputError]) -> None:
        self.faults = tuple(faults)
        super().__init__("{count} faults:", count=len(self.faults))

    def __str__(self) -> str:
        lines = [f"  {fault}" for fault in self.faults[:MAX_SHOWN_FAULTS]]
        if left := len(self.faults) - len(lines):
            lines.append(f"  {Message('and {count} more', count=left)}")
        return "\n".join([str(self.message), *lines])

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.faults,)

    def as_data(self) -> dict[str, Any]:
        """Return as every error does, and all faults."""
        return {**super().as_data(), "faults": [fault.as_data() for fault in self.faults]}


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
        hint: What to do about it; may be empty where `expected` says it all.
        line: Line in the file, counted from 1, when known.
        key: Key or column in the file, when known.
    """

    def __init__(
        self,
        path: str | Path,
        found: str | Message,
        expected: str | Message,
        hint: str | Message = "",
        *,
        line: int | None = None,
        key: str | None = None,
    ) -> None:
        self.path = Path(path)
        self.found, self.expected, self.hint = _message(found), _message(expected), _message(hint)
        self.line, self.key = line, key
        place = f"{path}" + (f":{line}" if line is not None else "") + (f": {shortened(key)}" if key else "")
        super().__init__(
            "{place}: {found}; expected {expected}. {hint}" if hint else "{place}: {found}; expected {expected}.",
            place=place, path=self.path, line=line, key=key, found=self.found, expected=self.expected, hint=self.hint,
        )  # fmt: skip

    def __str__(self) -> str:
        found = shortened(str(self.found))
        return str(Message(self.message.template, **{**self.message.fields, "found": found}))

    def __reduce__(self) -> tuple[Any, ...]:
        placed = functools.partial(type(self), line=self.line, key=self.key)
        return placed, (self.path, self.found, self.expected, self.hint)


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


def _message(text: str | Message) -> Message:
    return text if isinstance(text, Message) else Message(text)
