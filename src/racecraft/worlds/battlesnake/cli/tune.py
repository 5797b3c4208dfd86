"""`racecraft snakes tune`: search's weights, tuned by playing."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.worlds.battlesnake.cli.options import JSON, GameType, Height, MapName, Seed, Width, aside, check_folder

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.league.spsa import WeightTuner

INTERRUPTED = 130


def tune(
    file: Annotated[Path, typer.Argument(help="The file of weights; the same command goes on where it stopped.")],
    begin: Annotated[
        Path | None, typer.Option("--from", help="Weights to begin with; the usual ones without it.")
    ] = None,
    rounds: Annotated[int, typer.Option(help="Rounds of tuning; each has a game for every snake at the board.")] = 100,
    proof: Annotated[int, typer.Option(help="Games of the tuned weights against those before.")] = 200,
    effort: Annotated[int, typer.Option(help="Turns played forward for one move.")] = 400,
    snakes: Annotated[int, typer.Option(help="Snakes at a board: 2, 4, 6 or 8.")] = 2,
    width: Width = 11,
    height: Height = 11,
    gametype: GameType = "standard",
    map_name: MapName = "standard",
    most_turns: Annotated[int, typer.Option("--most-turns", help="A longer game is a draw.")] = 500,
    seed: Seed = 0,
    json: JSON = False,
) -> None:
    """Tune what search looks for in a position by playing; then prove it against the weights before.

    Both sides look at equally many positions a move. Ctrl-C keeps everything. `search:FILE` plays by the weights.

    Example: racecraft snakes tune tuned.json --rounds 300

    Example: racecraft snakes play --url search:tuned.json --url search
    """
    from racecraft.cli.output import print_json
    from racecraft.worlds.battlesnake.env.dice import StreamDice
    from racecraft.worlds.battlesnake.env.reference import Referee
    from racecraft.worlds.battlesnake.league.spsa import GauntletSettings, WeightTuner
    from racecraft.worlds.battlesnake.players.weights import read_weights, usual_among

    check_folder(file)
    settings = GauntletSettings(
        rounds, proof, effort, snakes, width, height, gametype, map_name, most_turns, seed or 0
    )  # fmt: skip
    Referee(settings.game, StreamDice(0))
    gauntlet = WeightTuner(file, settings, usual_among(snakes) if begin is None else read_weights(begin))
    if gauntlet.scores and not gauntlet.is_over:
        kept = f"{len(gauntlet.scores)} of {rounds} rounds and {len(gauntlet.proof)} of {proof} games"
        aside(f"{kept} are in the file already.")
    broken_off = False
    try:
        gauntlet.run(aside)
    except KeyboardInterrupt:
        aside("Broken off. The same command goes on from here.")
        broken_off = True
    if json:
        print_json(_facts(gauntlet))
    else:
        _print(gauntlet)
    if broken_off:
        raise typer.Exit(INTERRUPTED)


def _facts(gauntlet: WeightTuner) -> dict[str, object]:
    from dataclasses import asdict

    share, low, high = gauntlet.proven()
    proven = {"games": len(gauntlet.proof), "share": share, "low": low, "high": high}
    return {
        "file": str(gauntlet.path), "rounds": len(gauntlet.scores), "weights": asdict(gauntlet.weights()),
        "start": asdict(gauntlet.start), "proven": proven,
    }  # fmt: skip


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
