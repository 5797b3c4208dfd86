"""`racecraft snakes train`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from racecraft.actions.train_run import TrainedRun
from racecraft.cli.output import word
from racecraft.cli.train import train_command
from racecraft.worlds.battlesnake.actions.train import train as action

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.env.settings import GameSettings


def _show(trained: TrainedRun) -> None:
    from racecraft.worlds.battlesnake.env.settings import GameSettings

    summary, run = trained.summary(), trained.run.path
    judged = summary["evaluation"]
    print(f"{summary['env_steps']:,} steps; run: {run}")
    if judged is None:
        print("stopped before its first evaluation")
        return
    print(f"rating {judged['rating']:.0f} (95 %: {judged['rating_low']:.0f} to {judged['rating_high']:.0f}); won:")
    for name, result in judged["against"].items():
        print(f"  {result['won']:3} of {result['games']} against {name}")
    same = _same_game(GameSettings(**summary["game"]))
    print(f"next: racecraft snakes play --url {word(run)} --url flood_fill --view{same}")


def _same_game(game: GameSettings) -> str:
    """Return the options that make `snakes play` play what was trained, where they are not its defaults."""
    options = {"-W": game.width, "-H": game.height, "-g": game.ruleset, "-m": game.map}
    usual = {"-W": 11, "-H": 11, "-g": "standard", "-m": "standard"}
    return "".join(f" {flag} {value}" for flag, value in options.items() if value != usual[flag])


train = train_command(action, _show)
