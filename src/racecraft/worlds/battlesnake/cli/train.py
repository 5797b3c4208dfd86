"""`racecraft snakes train`: a snake that learns by playing against itself, its past and the built-in players."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from racecraft.cli.from_request import TerminalProgress, takes_requests
from racecraft.cli.options import Cluster, Json
from racecraft.cli.output import word
from racecraft.cli.training import Left, Road
from racecraft.settings.request import option_names
from racecraft.worlds.battlesnake.actions.train import GameOptions, SnakeTraining, snake_request

if TYPE_CHECKING:
    from racecraft.training.trainer import Trained
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.training.trainer import SnakeRequest


@takes_requests
def train(
    context: typer.Context,
    *,
    game: GameOptions,
    options: SnakeTraining,
    cluster: Cluster = None,
    json: Json = False,
) -> None:
    """Train a snake by self-play; its rating against the built-in players is shown as it learns.

    Examples:

        racecraft snakes train --snakes 2 --stop minutes=10

        racecraft snakes train --size 7 --ruleset wrapped --set selfplay.anchor_share=0.3

        racecraft snakes train --snakes 2 --algorithm alphazero --from runs/snakes-1 --anchors http://localhost:8000

        racecraft snakes train --run runs/snakes-1 --resume --stop minutes=20
    """

    def request() -> SnakeRequest:
        return snake_request(game, options, TerminalProgress(quiet_stdout=json))

    road = Road("battlesnake", "runs/snakes-1", option_names(GameOptions), model="snakes", cluster=cluster)
    road.train(context, options, request, _tell_trained, json)


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
