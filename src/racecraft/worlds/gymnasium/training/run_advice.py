"""How advice about a run is typed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.analysis.run_advice import typed
from racecraft.worlds.gymnasium.env.recipe import Recipe


def as_typed(command: str, job: Mapping[str, Any]) -> str:
    """Return a command of advice as it is typed for a run of this kind."""
    request = job.get("asked", {})
    environment = [request["environment"], *Recipe.of_data(request).as_words()] if request.get("environment") else []
    return typed(command, "racecraft gym train", job, environment)
