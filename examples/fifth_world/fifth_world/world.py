"""A corridor with its exit at the right end: step left or right, find out early."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from racecraft.contract.world import Array, ArraySpec, DiscreteActions, StepBuffers, WorldSpec

LEFT, RIGHT = 0, 1
PATIENCE = 50
"""Steps after which an episode is cut."""


class Corridor:
    """N corridors side by side, one walker in each, who begins in the middle.

    Args:
        num_worlds: N.
        length: Cells; the exit is the last one.
    """

    def __init__(self, num_worlds: int = 1, length: int = 9) -> None:
        place = ArraySpec((1,), np.float32, 0.0, 1.0, doc="Where the walker stands: 0 at the left end, 1 at the exit.")
        actions = DiscreteActions(2, ("left", "right"))
        self.spec = WorldSpec("corridor", num_worlds, 1, {"place": place}, actions)
        self._length = length
        self._cell, self._steps = np.zeros(num_worlds, np.int64), np.zeros(num_worlds, np.int64)

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every corridor anew."""
        self._begin(np.ones(self.spec.num_worlds, bool))
        self._show(buffers)

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Walk one cell; whoever reaches the exit, or has no patience left, begins again in the same step."""
        self._cell = np.clip(self._cell + 2 * actions[:, 0] - 1, 0, self._length - 1)
        self._steps += 1
        out = self._cell == self._length - 1
        late = ~out & (self._steps == PATIENCE)
        buffers.reward[:, 0] = np.where(out, 1.0, -0.01)
        buffers.terminated[:, 0], buffers.truncated[:, 0] = out, late
        buffers.final_observations["place"][:, 0, 0] = self._place()
        self._begin(out | late)
        self._show(buffers)

    def save_state(self) -> dict[str, Array]:
        """Return where everybody stands."""
        return {"cell": self._cell.copy(), "steps": self._steps.copy()}

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on from a saved state."""
        self._cell, self._steps = state["cell"].copy(), state["steps"].copy()
        self._show(buffers)

    def close(self) -> None:
        """Nothing is held."""

    def _begin(self, rows: Array) -> None:
        self._cell[rows], self._steps[rows] = self._length // 2, 0

    def _place(self) -> Array:
        return self._cell / (self._length - 1)

    def _show(self, buffers: StepBuffers) -> None:
        buffers.observations["place"][:, 0, 0] = self._place()
        buffers.active[:] = True
