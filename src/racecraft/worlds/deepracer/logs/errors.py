"""What can be wrong with a log, and how it is told."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.contract.errors import InputFileError


class LogError(InputFileError):
    """A path at which no log can be found, or a log that holds nothing."""


@dataclass(frozen=True, order=True)
class Damage:
    """Something in a file that could not be taken as it stands; the rest was read."""

    file: str
    """The file, as the user would name it."""
    line: int | None
    """Line in the file, counted from 1; None where the file as a whole is meant."""
    what: str
    """What is wrong with it, and what was done about it."""

    def __str__(self) -> str:
        """Return one line: file, line, what."""
        return f"{self.file}{'' if self.line is None else f':{self.line}'}: {self.what}"
