"""`racecraft snakes tune`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from racecraft.cli.from_request import command
from racecraft.worlds.battlesnake.actions.tune import TunedWeights, tune_weights

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.league.spsa import WeightTuner


def _show(tuned: TunedWeights) -> None:
    _print(tuned.gauntlet)


def _print(gauntlet: WeightTuner) -> None:
    from dataclasses import asdict

    print(f"{'weight':10} {'before':>8} {'tuned':>8}")
    for name, value in asdict(gauntlet.weights()).items():
        print(f"{name:10} {getattr(gauntlet.start, name):>8.4g} {value:>8.4g}")
    print(f"after {len(gauntlet.scores)} of {gauntlet.settings.rounds} rounds")
    if gauntlet.proof:
        print(f"{gauntlet.gain()}, {len(gauntlet.proof)} games")
        if gauntlet.is_over and gauntlet.proven()[1] <= 0.5:
            print("That may be chance: more rounds, or more games to prove it (--rounds, --proof, in another file).")
    if gauntlet.scores:
        print(f"Play by them: racecraft snakes play --url search:{gauntlet.path} --url search")


tune = command(tune_weights, _show, messages_aside=True)
