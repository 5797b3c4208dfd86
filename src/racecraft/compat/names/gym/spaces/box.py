"""`gym.spaces.box`: Gymnasium's, with the old one's patience for bounds that its numbers cannot hold."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np


class _AnyBox(type(gymnasium.spaces.Box)):  # type: ignore[misc]
    """Every box of Gymnasium's is one of these."""

    def __instancecheck__(cls, instance: Any) -> bool:
        return isinstance(instance, gymnasium.spaces.Box) if cls is Box else super().__instancecheck__(instance)


class Box(gymnasium.spaces.Box, metaclass=_AnyBox):
    """Numbers between bounds.

    Bounds that the type cannot hold (-1 of uint8) passed in the old gym; the numbers are float32 then.
    """

    def __init__(self, low: Any, high: Any, shape: Any = None, dtype: Any = np.float32, seed: Any = None) -> None:
        kind = np.dtype(dtype)
        if np.issubdtype(kind, np.integer):
            held = np.iinfo(kind)
            if np.min(low) < held.min or np.max(high) > held.max:
                kind = np.dtype(np.float32)
        super().__init__(np.asarray(low, kind) if shape is None else low, high, shape, kind.type, seed)


__all__ = ["Box"]
