"""What a mishap costs a car, in a race alone as among others. Begin with `MishapRules`.

A new penalty is a field here, with its share in `waiting_ticks`, and its option in `actions/mishap_options.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from racecraft.settings.table import check_group, setting
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND

MISHAPS = {
    race.CRASHED: "crashed",
    race.OFF_TRACK: "off_track",
    race.REVERSED: "reversed",
    race.IMMOBILISED: "immobilized",
}


@dataclass(frozen=True, kw_only=True)
class MishapRules:
    """How often a car is set back, and how long it waits; names and defaults are those of DeepRacer for Cloud."""

    max_resets: int = setting(100, "How often a car is set back; its next mishap ends the drive.", low=0, high=10_000)
    off_track_penalty: float = setting(
        5.0, "Wait after leaving the road or driving backwards.", unit="s", low=0.0, high=600.0
    )
    collision_penalty: float = setting(5.0, "Wait after hitting an object.", unit="s", low=0.0, high=600.0)

    def __post_init__(self) -> None:
        """Refuse what no race can be.

        Raises:
            SettingError: A number is out of its range, or a word none of the choices.
        """
        check_group(self)

    def mishaps(self) -> dict[str, Any]:
        """Return these rules by name, for a race of another kind."""
        return {one.name: getattr(self, one.name) for one in fields(MishapRules)}

    def waiting_ticks(self, status: int) -> int:
        """Return how many ticks a car waits after a mishap, by its code; after standing still it does not."""
        seconds = {race.IMMOBILISED: 0.0, race.CRASHED: self.collision_penalty}
        return round(seconds.get(status, self.off_track_penalty) * TICKS_PER_SECOND)
