"""How advice about a run is typed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.analysis.run_advice import typed


def as_typed(command: str, job: Mapping[str, Any]) -> str:
    """Return a command of advice as it is typed for a run of this kind."""
    build = job.get("asked", {}).get("build")
    return typed(command, "racecraft unity train", job, [build] if build else [])
