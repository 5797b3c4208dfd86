"""What a policy promises: from named observations to actions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

from racecraft.contract.world import Array


@runtime_checkable
class Policy(Protocol):
    """Whatever can act: a trained network, a heuristic, a search, a person at the keyboard."""

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Choose an action for every row.

        Args:
            observations: Named arrays of shape (R, ...), one row an agent. A policy reads the names it knows and
                ignores the others.
            action_mask: bool (R, A), True where an action is allowed, or None.

        Returns:
            Actions of shape (R, *action shape), in the type of the world's action spec.
        """
        ...

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows (bool, shape (R,)) whose episode ended; a policy without memory does nothing."""
        ...
