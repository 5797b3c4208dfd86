"""What a mishap costs in a race: the options of every command that drives one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from racecraft.settings.request import Request, option


@dataclass(frozen=True, kw_only=True)
class MishapOptions(Request):
    """Rules of `evaluation.mishap_rules.MishapRules` as they were given; None: not given."""

    PANEL: ClassVar[str] = "Mishaps in a race"
    max_resets: int | None = option(
        None, "How often a car is set back, 100 by default; its next mishap ends the drive (DR_EVAL_MAX_RESETS)."
    )
    off_track_penalty: float | None = option(
        None, "Seconds it waits after leaving the road, 5 by default (DR_EVAL_OFF_TRACK_PENALTY)."
    )
    collision_penalty: float | None = option(
        None, "Seconds it waits after hitting an object or a car, 5 by default (DR_EVAL_COLLISION_PENALTY)."
    )

    def typed(self) -> dict[str, Any]:
        """Return what was typed, by name."""
        return {name: value for name, value in self.values().items() if value is not None}
