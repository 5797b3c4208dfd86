"""Train a snake: its options, and the request they make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.actions.training_options import TrainingOptions
from racecraft.settings.request import Request, option

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.training.trainer import SnakeRequest


@dataclass(frozen=True, kw_only=True)
class GameOptions(Request):
    """Which game is learned, and against whom besides itself."""

    size: int = option(11, "Side of the board, in squares.")
    width: int | None = option(None, "Squares from left to right, where it is not --size.", "--width", "-W")
    height: int | None = option(None, "Squares from bottom to top, where it is not --size.", "--height", "-H")
    snakes: int = option(4, "Snakes at a board.")
    ruleset: str = option("standard", "standard, royale, constrictor, wrapped, …", "--ruleset", "-g")
    map_: str = option("standard", "standard, empty, royale, arcade_maze, …", "--map", "-m")
    anchors: tuple[str, ...] = option(
        (), "A foreign snake to learn against: URL of a server, RUN, FILE.py or name; may be repeated."
    )

    def settings(self) -> GameSettings:
        """Return the game.

        Raises:
            SettingError: There is none like it.
        """
        from racecraft.worlds.battlesnake.env.settings import GameSettings

        return GameSettings(self.width or self.size, self.height or self.size, self.snakes, self.ruleset, self.map_)

    def overrides(self) -> list[str]:
        """Return what --anchors comes to as settings."""
        return [f"selfplay.foreign={','.join(self.anchors)}"] if self.anchors else []


@dataclass(frozen=True, kw_only=True)
class SnakeTraining(TrainingOptions):
    """What a training of snakes is asked."""

    stop: tuple[str, ...] = option((), "rating=1900, minutes=10, iterations=50, steps=200000; may be repeated.")
    run: Path | None = option(None, "Run folder to make; by default runs/snakes-N.")


def snake_request(game: GameOptions, options: SnakeTraining, progress: Callable[[str], None]) -> SnakeRequest:
    """Return the request of a new run."""
    from racecraft.worlds.battlesnake.training.trainer import SnakeRequest

    played = game.settings()
    options = replace(options, set_=(*options.set_, *game.overrides()))
    return SnakeRequest(played, **options.for_request(options.source(progress)))
