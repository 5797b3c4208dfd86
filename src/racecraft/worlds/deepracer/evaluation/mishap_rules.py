"""What a mishap costs a car, in a race alone as among others. Begin with `MishapRules`.

A new penalty is a field here, with its share in `waiting_ticks`, and its option in `actions/mishap_options.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from racecraft.contract.errors import SettingError
from racecraft.settings.table import rows_of, setting
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

    def mishaps(self) -> dict[str, Any]:
        """Return these rules by name, for a race of another kind."""
        return {one.name: getattr(self, one.name) for one in fields(MishapRules)}

    def waiting_ticks(self, status: int) -> int:
        """Return how many ticks a car waits after a mishap, by its code; after standing still it does not."""
        seconds = {race.IMMOBILISED: 0.0, race.CRASHED: self.collision_penalty}
        return round(seconds.get(status, self.off_track_penalty) * TICKS_PER_SECOND)


RANGES: Mapping[str, tuple[float, float]] = {
    row.name: (row.low, row.high) for row in rows_of(MishapRules) if row.low is not None and row.high is not None
}
"""Least and most of each number of a MishapRules."""


def check_ranges(rules: MishapRules, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Refuse what no race can be; None is not looked at.

    Args:
        rules: Of a race.
        ranges: Least and most of each further number, beside `RANGES`.

    Raises:
        SettingError: A number is out of its range.
    """
    for name, (least, most) in {**ranges, **RANGES}.items():
        value = getattr(rules, name)
        if value is not None and not least <= value <= most:
            raise SettingError(
                "{name} is {value:g}; expected {least:g} to {most:g}.", name=name, value=value, least=least, most=most
            )
