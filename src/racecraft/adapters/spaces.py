"""Our specs as Gymnasium spaces, and rows of named arrays as they are asked for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces

from racecraft.contract.world import (
    ActionSpec,
    Array,
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
    WorldSpec,
)


def observation_space(spec: WorldSpec) -> spaces.Space[Any]:
    """Return the space of one agent's observation: a Box if there is one that is not privileged, else a Dict."""
    boxes: dict[str, spaces.Space[Any]] = {
        name: box(part) for name, part in spec.observations.items() if not part.privileged
    }
    return next(iter(boxes.values())) if len(boxes) == 1 else spaces.Dict(boxes)


def action_space(actions: ActionSpec) -> spaces.Space[Any]:
    """Return the space of one agent's action; numbers and choices at once are one Box, choices as whole numbers."""
    if isinstance(actions, ContinuousActions):
        return spaces.Box(np.array(actions.low, np.float32), np.array(actions.high, np.float32), dtype=np.float32)
    if isinstance(actions, DiscreteActions):
        return spaces.Discrete(actions.count)
    if isinstance(actions, MultiDiscreteActions):
        return spaces.MultiDiscrete(list(actions.counts))
    if isinstance(actions, HybridActions):
        numbers, counts = actions.continuous, actions.discrete.counts
        low, high = (*numbers.low, *(0.0 for _ in counts)), (*numbers.high, *(count - 1.0 for count in counts))
        return spaces.Box(np.array(low, np.float32), np.array(high, np.float32), dtype=np.float32)
    return spaces.Box(-np.inf, np.inf, actions.shape, np.float32)


def box(part: ArraySpec) -> spaces.Box:
    """Return a named array's spec as a Box; its bounds are held within what its type can hold.

    >>> box(ArraySpec((2,), np.uint8))
    Box(0, 255, (2,), uint8)
    """
    kind = np.dtype(part.dtype)
    low, high = part.low, part.high
    if kind.kind in "iu":
        low, high = max(low, np.iinfo(kind).min), min(high, np.iinfo(kind).max)
    elif kind.kind == "b":
        low, high, kind = 0, 1, np.dtype(np.int8)
    return spaces.Box(low, high, part.shape, kind.type)


def flat_rows(spec: WorldSpec, named: Mapping[str, Array]) -> Any:
    """Return (N, M, ...) arrays as rows (N * M, ...), copied: one array, or a dictionary of them."""
    rows = {
        name: named[name].reshape(-1, *part.shape).copy()
        for name, part in spec.observations.items()
        if not part.privileged
    }
    return next(iter(rows.values())) if len(rows) == 1 else rows


def row_of(observation: Any, row: int) -> Any:
    """Return one row of what `flat_rows` gave."""
    return (
        {name: array[row] for name, array in observation.items()} if isinstance(observation, dict) else observation[row]
    )
