"""How advice about a run is typed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.analysis.account import typed


def as_typed(command: str, job: Mapping[str, Any]) -> str:
    """Return a command of advice as it is typed for a run of this kind."""
    environment = job.get("asked", {}).get("environment")
    return typed(command, "racecraft gym train", job, [environment] if environment else [])
