"""How an action reports while it works: messages, and how much of something is done."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from subprocess import DEVNULL
from typing import Any

from racecraft.contract.errors import UserInputError

Count = Callable[[int, int], None]
"""Called with how many are done and how many there are in all."""


class Progress:
    """Receives what an action reports; this one ignores it. A callback of messages alone is a plain function."""

    def __call__(self, message: str) -> None:
        """Receive a line for a person."""

    @property
    def is_before_person(self) -> bool:
        """Whether a person at a terminal reads it."""
        return False

    @property
    def child_output(self) -> int | None:
        """Where a child process prints, as `subprocess` takes it."""
        return DEVNULL

    def training_callback(self) -> Any:
        """Return a `TrainingCallback` that shows each iteration of a training; None: nothing shows it."""
        return None

    def confirm(self, question: str) -> None:
        """Ask a person before something is changed.

        Raises:
            UserInputError: No terminal to answer it.
        """
        raise UserInputError(
            "{question} No terminal to answer it; expected -f where nothing shall be asked.", question=question
        )

    @contextmanager
    def counting(self, unit: str) -> Iterator[Count]:
        """Yield a callback that receives how much is done.

        Args:
            unit: What is counted: "pictures".
        """
        yield lambda done, total: None


quiet = Progress()
"""Ignores every report."""
