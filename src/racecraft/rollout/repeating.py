"""An actor that decides again what was once decided. See `Repeats`."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch

from racecraft.algorithms.learner import Decision
from racecraft.contract.world import Array, ArraySpec


class Repeats:
    """Decides tick by tick what it is given, whatever it sees."""

    device = torch.device("cpu")
    columns: Mapping[str, ArraySpec] = {}

    def __init__(self) -> None:
        self._actions: Array = np.zeros(0)
        self.tick = 0
        """How many ticks were decided since `take_up`."""

    def take_up(self, actions: Array) -> None:
        """Go on with other actions, (T, R, ...)."""
        self._actions, self.tick = actions, 0

    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Decide for R rows; see `Actor.act`."""
        actions = self._actions[self.tick]
        self.tick += 1
        return Decision(actions if rows is None else actions[rows], {})

    def forget(self, rows: Array) -> None:
        """Nothing is remembered."""
