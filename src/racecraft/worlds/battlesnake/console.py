"""Snakes in the console: the form in which a training is made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from racecraft.algorithms.registry import CHOICES, choices
from racecraft.console.form import Field, Step, common_fields, common_words
from racecraft.console.parts import RaceMaking, WorldParts

RULESETS = ("standard", "royale", "constrictor", "wrapped", "solo")


class SnakeParts(WorldParts):
    """Snakes in the console."""

    noun = "snake"

    def steps(self, values: Mapping[str, Any]) -> list[Step]:
        """Return the one step in which a training is made."""
        fields = (
            Field(
                name="size", label="Side of the board", default=11, kind="whole", low=5, high=25, unit="squares",
                matters=True, names=(("--size", "11"),),
            ),
            Field(
                name="snakes", label="Snakes at a board", default=2, kind="whole", low=1, high=8, matters=True,
                sentence="Two learn soonest; four is the arena's usual game.", names=(("--snakes", "2"),),
            ),
            Field(
                name="ruleset", label="Rules", default="standard", kind="choice",
                choices=tuple((one, one) for one in RULESETS), names=(("--ruleset", "standard"),),
            ),
        )  # fmt: skip
        return [
            Step(
                key="training",
                title="Training",
                fields=(*fields, *common_fields(choices(CHOICES, searches=True), 10.0)),
            )
        ]

    def words(self, values: Mapping[str, Any]) -> list[str]:
        """Return `snakes train` and its options."""
        full = self.defaults() | dict(values)
        board = [f"--size={full['size']}", f"--snakes={full['snakes']}", f"--ruleset={full['ruleset']}"]
        return ["snakes", "train", *board, *common_words(full)]

    def race_making(self) -> RaceMaking:
        """Return the action that makes a race of snakes, and the maps."""
        from racecraft.worlds.battlesnake.actions.create_race import create_snake_race

        return RaceMaking(
            action=create_snake_race,
            command="league create-snakes",
            first=("title", "map_name", "snakes", "format", "meetings", "closes", "season"),
            choices={},
        )
