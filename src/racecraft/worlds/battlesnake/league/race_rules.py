"""The rules of a race of snakes, and who may enter it. Begin with `SnakeRules`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from racecraft.league.world_part import require_known_rules
from racecraft.settings.table import check_group, setting
from racecraft.worlds.battlesnake.env.rulesets import find_ruleset
from racecraft.worlds.battlesnake.env.settings import LARGEST_SIDE, GameSettings


@dataclass(frozen=True)
class SnakeRules:
    """How games are played, and which players may enter."""

    width: int = setting(11, "Squares from left to right.", low=3, high=LARGEST_SIDE)
    height: int = setting(11, "Squares from bottom to top.", low=3, high=LARGEST_SIDE)
    ruleset: str = setting("standard", "Official name of the rules.")
    timeout_ms: int = setting(500, "Time for an answer.", unit="ms", low=1, high=60_000)
    most_turns: int = setting(1000, "A longer game is a draw of all who live.", low=1, high=100_000)
    files: bool = setting(True, "A FILE.py may enter; it can compute and nothing else.")
    addresses: bool = setting(True, "Servers may enter by their address.")
    file_memory: int = setting(512, "Memory of a FILE.py.", unit="MB", low=64, high=65_536)

    def __post_init__(self) -> None:
        check_group(self)
        find_ruleset(self.ruleset)

    @classmethod
    def from_dictionary(cls, values: Mapping[str, Any]) -> SnakeRules:
        """Return the rules that `as_dictionary` wrote.

        Raises:
            SettingError: An unknown rule, or a value out of its range.
        """
        require_known_rules(cls, values)
        return cls(**values)

    def as_dictionary(self) -> dict[str, Any]:
        """Return every rule by name, fit for JSON."""
        return asdict(self)

    def game(self, map_name: str, snakes: int) -> GameSettings:
        """Return a game of so many snakes on a map.

        Raises:
            BoardError: There is no such map.
        """
        return GameSettings(self.width, self.height, snakes, self.ruleset, map_name)

    def describe(self) -> list[str]:
        """Return the rules, a line each."""
        enter = ["runs", *["files"] * self.files, *["addresses"] * self.addresses, "built-in players"]
        return [
            f"{self.ruleset} rules on {self.width} x {self.height} squares; {self.timeout_ms} ms for an answer",
            f"a game ends after {self.most_turns} turns; every heat has a game for each seat, on equal dice",
            f"may enter: {', '.join(enter)}",
        ]
