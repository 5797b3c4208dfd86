"""How workers are reached, as the rest of the package sees it. Begin with `Transport`."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Protocol

from racecraft.contract.errors import RacecraftError, UserInputError

Handle = Any
"""A worker, as a transport knows it."""
Ticket = Any
"""A question that is under way; may be a key of a dictionary."""


class WorkerLostError(RacecraftError):
    """A worker is gone, and its answer with it."""


class ClusterError(UserInputError):
    """A cluster that cannot be reached, or that workers do not come from."""


class Transport(Protocol):
    """Reaches workers."""

    @property
    def capacity(self) -> int:
        """How many workers it can carry."""
        ...

    def start(self) -> Handle:
        """Start a worker; it may come later."""
        ...

    def ask(self, worker: Handle, what: str, message: Any) -> Ticket:
        """Ask a worker for a method with one message; what one worker is asked, it does in that order."""
        ...

    def for_all(self, message: Any) -> Any:
        """Return a message in a form that costs little to send to many workers."""
        ...

    def answered(self, tickets: Collection[Ticket], seconds: float) -> list[Ticket]:
        """Wait until one of the questions is answered, or lost, or the seconds are over; return those that are."""
        ...

    def answer(self, ticket: Ticket) -> Any:
        """Return an answer that is there.

        Raises:
            WorkerLostError: The worker, or its answer, is gone.
        """
        ...

    def end(self, worker: Handle) -> None:
        """End a worker's process, whatever it is at."""
        ...

    def close(self) -> None:
        """End all workers, and whatever else was started for them. Doing so twice is doing so once."""
        ...
