"""`ray.rllib.utils.annotations`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def override(cls: type) -> Callable[[Any], Any]:
    """Mark what a class has otherwise than its base."""
    return lambda method: method


__all__ = ["override"]
