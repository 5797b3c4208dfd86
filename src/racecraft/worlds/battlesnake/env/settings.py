"""What one game is played with: board, players, ruleset, map and the numbers of the rules."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.contract.errors import SettingError
from racecraft.settings.table import check_group, setting
from racecraft.worlds.battlesnake.env.board import BoardError

LARGEST_SIDE = 25
MAX_PLAYERS = 16


@dataclass(frozen=True)
class GameSettings:
    """Settings of one game; the defaults are those of the official command line (facts: A.11)."""

    width: int = 11
    """Squares from left to right."""
    height: int = 11
    """Squares from bottom to top."""
    players: int = 4
    """Snakes that begin the game."""
    ruleset: str = "standard"
    """A key of `rulesets.RULESETS`."""
    map: str = "standard"
    """A key of `maps.MAPS`."""
    food_spawn_chance: int = 15
    """Percent, 0 to 100; the standard maps add a food with a probability of (chance - 1) percent (facts: A.8)."""
    minimum_food: int = 1
    """Food below this number is filled up at once."""
    hazard_damage: int = 14
    """Health a hazard takes, per stacked hazard; negative heals."""
    shrink_every: int = 25
    """Turns between two changes of the hazards, in the ruleset royale and the maps that have a schedule."""
    solo: bool | None = None
    """Whether the game goes on with one snake alive; None: as the ruleset says."""

    def __post_init__(self) -> None:
        """Refuse numbers that no game can be played with."""
        _check("width", self.width, 3, LARGEST_SIDE)
        _check("height", self.height, 3, LARGEST_SIDE)
        _check("players", self.players, 1, MAX_PLAYERS)
        _check("food_spawn_chance", self.food_spawn_chance, 0, 100)
        _check("minimum_food", self.minimum_food, 0, self.width * self.height)
        _check("hazard_damage", self.hazard_damage, -100, 100)
        _check("shrink_every", self.shrink_every, 0, 1_000_000)

    @property
    def area(self) -> int:
        """Squares on the board."""
        return self.width * self.height


def _check(name: str, value: int, low: int, high: int) -> None:
    if not low <= value <= high:
        raise BoardError("{name} is {value}; expected {low} to {high}.", name=name, value=value, low=low, high=high)


@dataclass(frozen=True)
class SnakeConfig:
    """What a learning snake sees, what it is paid and how long its games last."""

    view: int = setting(11, "Side of the window about the head; odd.", unit="squares", low=3, high=49)
    outlook: bool = setting(
        True, "Whether a snake is told the room, territory, food and heads behind each of its moves."
    )
    food_prize: float = setting(0.0, "Reward for a food; a win is worth 1, a death -1.", low=-1.0, high=1.0)
    max_turns: int = setting(500, "A game that lasts longer is cut.", unit="turns", low=1)

    def __post_init__(self) -> None:
        check_group(self)
        if self.view % 2 == 0:
            raise SettingError("snake.view is {view}; expected an odd number of squares.", view=self.view)
