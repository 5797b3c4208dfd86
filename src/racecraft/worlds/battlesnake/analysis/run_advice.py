"""How advice about a run is typed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.analysis.run_advice import typed

OPTIONS = {"-W": "width", "-H": "height", "--snakes": "players", "-g": "ruleset", "-m": "map"}
"""Options of `racecraft snakes train` by what job.json calls them."""


def as_typed(command: str, job: Mapping[str, Any]) -> str:
    """Return a command of advice as it is typed for a run of this kind, with its game."""
    game = job.get("asked", {}).get("game", {})
    words = [word for option, name in OPTIONS.items() if name in game for word in (option, game[name])]
    return typed(command, "racecraft snakes train", job, words)
