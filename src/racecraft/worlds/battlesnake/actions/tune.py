"""Tune search's weights by playing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option
from racecraft.worlds.battlesnake.actions.options import BoardOptions, check_folder

if TYPE_CHECKING:
    from racecraft.worlds.battlesnake.league.spsa import WeightTuner

INTERRUPTED = 130


@dataclass(frozen=True, kw_only=True)
class TuneWeightsRequest(Request):
    """Which weights are tuned, by how many games."""

    file: Path = argument("The file of weights; the same command goes on where it stopped.")
    begin: Path | None = option(None, "Weights to begin with; the usual ones without it.", "--from")
    rounds: int = option(100, "Rounds of tuning; each has a game for every snake at the board.")
    proof: int = option(200, "Games of the tuned weights against those before.")
    effort: int = option(400, "Turns played forward for one move.")
    snakes: int = option(2, "Snakes at a board: 2, 4, 6 or 8.")
    board: BoardOptions = group(BoardOptions)
    most_turns: int = option(500, "A longer game is a draw.")
    seed: int | None = option(0, "Chance of the game; without it, another every time.", "--seed", "-r")


@dataclass(frozen=True)
class TunedWeights:
    """The weights as far as they are tuned."""

    gauntlet: WeightTuner
    exit_code: int
    """130: Ctrl-C ended it."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return weights and proof by name."""
        from dataclasses import asdict

        share, low, high = self.gauntlet.proven()
        proven = {"games": len(self.gauntlet.proof), "share": share, "low": low, "high": high}
        return {
            "file": str(self.gauntlet.path), "rounds": len(self.gauntlet.scores),
            "weights": asdict(self.gauntlet.weights()), "start": asdict(self.gauntlet.start), "proven": proven,
        }  # fmt: skip


@action
def tune_weights(request: TuneWeightsRequest, progress: Progress = quiet) -> TunedWeights:
    """Tune what search looks for in a position by playing; then prove it against the weights before.

    Both sides look at equally many positions a move. Ctrl-C keeps everything. `search:FILE` plays by the weights.

    Example: racecraft snakes tune tuned.json --rounds 300

    Example: racecraft snakes play --url search:tuned.json --url search
    """
    from racecraft.worlds.battlesnake.env.dice import StreamDice
    from racecraft.worlds.battlesnake.env.reference import Referee
    from racecraft.worlds.battlesnake.league.spsa import GauntletSettings, WeightTuner
    from racecraft.worlds.battlesnake.players.weights import default_weights, read_weights

    check_folder(request.file)
    board, snakes = request.board, request.snakes
    settings = GauntletSettings(
        request.rounds, request.proof, request.effort, snakes, board.width, board.height, board.gametype,
        board.map_name, request.most_turns, request.seed or 0,
    )  # fmt: skip
    Referee(settings.game, StreamDice(0))
    weights = default_weights(snakes) if request.begin is None else read_weights(request.begin)
    gauntlet = WeightTuner(request.file, settings, weights)
    if gauntlet.scores and not gauntlet.is_over:
        kept = f"{len(gauntlet.scores)} of {request.rounds} rounds and {len(gauntlet.proof)} of {request.proof} games"
        progress(f"{kept} are in the file already.")
    broken_off = False
    try:
        gauntlet.run(progress)
    except KeyboardInterrupt:
        progress("Broken off. The same command goes on from here.")
        broken_off = True
    return TunedWeights(gauntlet, INTERRUPTED if broken_off else 0)
