"""`racecraft snakes train`: a snake that learns by playing against itself, its past and the built-in players."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.cli.option_groups import option_names, takes_groups
from racecraft.cli.options import Cluster
from racecraft.cli.output import word
from racecraft.cli.training import Left, Road, TrainingOptions

if TYPE_CHECKING:
    from racecraft.training.trainer import Trained
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.training.trainer import SnakeRequest


@dataclass(frozen=True)
class GameOptions:
    """Which game is learned, and against whom besides itself."""

    size: Annotated[int, typer.Option(help="Side of the board, in squares.")] = 11
    width: Annotated[
        int | None, typer.Option("--width", "-W", help="Squares from left to right, where it is not --size.")
    ] = None
    height: Annotated[
        int | None, typer.Option("--height", "-H", help="Squares from bottom to top, where it is not --size.")
    ] = None
    snakes: Annotated[int, typer.Option(help="Snakes at a board.")] = 4
    ruleset: Annotated[str, typer.Option("--ruleset", "-g", help="standard, royale, constrictor, wrapped, …")] = (
        "standard"
    )
    map_: Annotated[str, typer.Option("--map", "-m", help="standard, empty, royale, arcade_maze, …")] = "standard"
    anchors: Annotated[
        list[str] | None,
        typer.Option(help="A foreign snake to learn against: URL of a server, RUN, FILE.py or name; may be repeated."),
    ] = None

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


@dataclass(frozen=True)
class SnakeTraining(TrainingOptions):
    """What a training of snakes is asked."""

    stop: Annotated[
        list[str] | None,
        typer.Option(help="rating=1900, minutes=10, iterations=50, steps=200000; may be repeated."),
    ] = None
    run: Annotated[Path | None, typer.Option(help="Run folder to make; by default runs/snakes-N.")] = None


@takes_groups
def train(
    context: typer.Context,
    *,
    game: GameOptions,
    options: SnakeTraining,
    cluster: Cluster = None,
) -> None:
    """Train a snake by self-play; its rating against the built-in players is shown as it learns.

    Examples:

        racecraft snakes train --snakes 2 --stop minutes=10

        racecraft snakes train --size 7 --ruleset wrapped --set selfplay.anchor_share=0.3

        racecraft snakes train --snakes 2 --algorithm alphazero --from runs/snakes-1 --anchors http://localhost:8000

        racecraft snakes train --run runs/snakes-1 --resume --stop minutes=20
    """

    def request() -> SnakeRequest:
        from racecraft.worlds.battlesnake.training.trainer import SnakeRequest

        played = game.settings()
        told = replace(options, set_=[*(options.set_ or ()), *game.overrides()])
        return SnakeRequest(played, **told.asked(options.source()))

    road = Road("battlesnake", "runs/snakes-1", option_names(GameOptions), model="snakes", cluster=cluster)
    road.train(context, options, request, _tell_trained)


def _tell_trained(trained: Trained, left: Left) -> None:
    from racecraft.worlds.battlesnake.env.settings import GameSettings

    summary, run = trained.summary(), trained.run.path
    judged = summary["evaluation"]
    print(f"{summary['env_steps']:,} steps; run: {run}")
    if judged is None:
        print("stopped before its first evaluation")
        return
    print(f"rating {judged['rating']:.0f} (95 %: {judged['rating_low']:.0f} to {judged['rating_high']:.0f}); won:")
    for name, told in judged["against"].items():
        print(f"  {told['won']:3} of {told['games']} against {name}")
    same = _same_game(GameSettings(**summary["game"]))
    print(f"next: racecraft snakes play --url {word(run)} --url flood_fill --view{same}")


def _same_game(game: GameSettings) -> str:
    """Return the options that make `snakes play` play what was trained, where they are not its defaults."""
    asked = {"-W": game.width, "-H": game.height, "-g": game.ruleset, "-m": game.map}
    usual = {"-W": 11, "-H": 11, "-g": "standard", "-m": "standard"}
    return "".join(f" {flag} {value}" for flag, value in asked.items() if value != usual[flag])
