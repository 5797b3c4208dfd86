"""Train a snake: its options, and the request they make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from racecraft.actions.action import action
from racecraft.actions.submit_job import Submitted
from racecraft.actions.train_run import Planned, TrainedRun, train_run
from racecraft.actions.train_seeds import TrainedSeeds
from racecraft.actions.training_options import TrainingOptions
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, group, option

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.training.trainer import SnakeRequest


@dataclass(frozen=True, kw_only=True)
class GameOptions(Request):
    """Which game is learned, and against whom besides itself."""

    PANEL: ClassVar[str] = "The game"
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

    kind: ClassVar[str] = "battlesnake"
    example: ClassVar[str] = "runs/snakes-1"

    stop: tuple[str, ...] = option((), "rating=1900, minutes=10, iterations=50, steps=200000; may be repeated.")
    run: Path | None = option(None, "Run folder to make; by default runs/snakes-N.")
    game: GameOptions = group(GameOptions)

    @property
    def model(self) -> str | None:
        """Snakes have no name of their own."""
        return "snakes"

    def request(self, progress: Callable[[str], None]) -> SnakeRequest:
        """Return the request of a new run."""
        from racecraft.worlds.battlesnake.training.trainer import SnakeRequest

        return SnakeRequest(self.game.settings(), **self.for_request(self.source(progress)))

    @property
    def overrides(self) -> tuple[str, ...]:
        """The settings, those that options of the game stand for among them."""
        return (*super().overrides, *self.game.overrides())


@action
def train(request: SnakeTraining, progress: Progress = quiet) -> TrainedRun | TrainedSeeds | Submitted | Planned:
    """Train a snake by self-play; its rating against the built-in players is shown as it learns.

    Examples:

        racecraft snakes train --snakes 2 --stop minutes=10

        racecraft snakes train --size 7 --ruleset wrapped --set selfplay.anchor_share=0.3

        racecraft snakes train --snakes 2 --algorithm alphazero --from runs/snakes-1 --anchors http://localhost:8000

        racecraft snakes train --run runs/snakes-1 --resume --stop minutes=20
    """
    return train_run(request, progress)
