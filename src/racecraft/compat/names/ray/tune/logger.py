"""`ray.tune.logger`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.compat.rllib_results import NOT_TOLD, lines


def pretty_print(result: Mapping[str, Any]) -> str:
    """Return a result's figures as text, a line each; lists of every episode's figures are left out."""
    return "\n".join([*lines({name: value for name, value in result.items() if name not in NOT_TOLD}), ""])


__all__ = ["pretty_print"]
