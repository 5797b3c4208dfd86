"""A gauntlet: weights of search tuned by playing, and at its end the proof of it. Begin with `WeightTuner.run`.

Simultaneous perturbation (Spall, "Multivariate stochastic approximation using a simultaneous perturbation gradient
approximation", 1992): in each round all weights are nudged at once, some up and some down at random; who has them the
one way plays who has them the other way; and the weights move a little towards the winner. It needs few games a round,
however many weights there are, and forgives the noise of their outcomes. Nudges are factors: weights differ in size.
What comes out is the mean over the second half of the rounds.

Both sides look at equally many positions a move. That is equal time, for weights change nothing about what a look
costs; and it makes a gauntlet the same on every machine, however busy. Then the tuned weights meet those it began with,
with dice that no round has seen; only these games say what was gained.

Everything is written after each round and after each game of the proof, so that it goes on where it was stopped.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import InputFileError, SettingError
from racecraft.contract.message import Message
from racecraft.contract.random_streams import generator, stream_keys
from racecraft.contract.world import Array
from racecraft.evaluation.rating import wilson
from racecraft.formats.atomic import write_atomic
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.match import play
from racecraft.worlds.battlesnake.evaluation.seats import Seat
from racecraft.worlds.battlesnake.players.search import Search
from racecraft.worlds.battlesnake.players.weights import Weights, read_weights_file, weights_in, weights_text

NAMES = tuple(field.name for field in fields(Weights))
NUDGE, STEP = 0.25, 0.15
"""Size of the first nudge, and of the first move after a round won altogether; both in nats, so 0.25 is a fifth."""
PATIENCE = 0.1
"""Share of all rounds in which moves hardly shrink (Spall's A)."""
LEAST, MOST = 1e-3, 1.0
NO_HURRY_MS = 600_000


@dataclass(frozen=True)
class GauntletSettings:
    """What a gauntlet plays; the same from its first round to its last.

    Raises:
        SettingError: A number is out of its range.
    """

    rounds: int = 100
    """Rounds of tuning, of `snakes` games each: one with every turn of the seats."""
    proof: int = 200
    """Games of the tuned weights against those it began with."""
    effort: int = 400
    """Turns played forward, or walks of the tree, for one move."""
    snakes: int = 2
    """Snakes at a board; of four, two have the weights the one way."""
    width: int = 11
    """Squares from left to right."""
    height: int = 11
    """Squares from bottom to top."""
    ruleset: str = "standard"
    """Official name of the rules."""
    map: str = "standard"
    """Official name of the map."""
    most_turns: int = 500
    """A longer game is a draw."""
    seed: int = 0
    """Chance of nudges and games."""

    def __post_init__(self) -> None:
        if self.snakes < 2 or self.snakes % 2 or self.snakes > 8:
            raise SettingError(
                "{snakes} snakes at a board; expected 2, 4, 6 or 8, half of them on each side.", snakes=self.snakes
            )
        for name, least in (("rounds", 1), ("proof", 1), ("effort", 16), ("most_turns", 1)):
            if getattr(self, name) < least:
                raise SettingError(
                    "{name} is {problem}; expected {least} or more.",
                    name=name,
                    problem=getattr(self, name),
                    least=least,
                )

    @property
    def game(self) -> GameSettings:
        """Settings of one game."""
        return GameSettings(self.width, self.height, self.snakes, self.ruleset, self.map)


class WeightTuner:
    """Tunes weights, and keeps how far it is in the file that will hold them.

    Args:
        path: The file of weights; where it holds this gauntlet already, it goes on.
        settings: What is played.
        start: The weights to begin with.

    Raises:
        InputFileError: Another gauntlet, or something else, stands in the file.
    """

    def __init__(self, path: str | Path, settings: GauntletSettings, start: Weights) -> None:
        self.path, self.settings, self.start = Path(path), settings, start
        self.scores: list[float] = []
        """What the side with the upward nudge took of each round's games, 0 to 1."""
        self.proof: list[float] = []
        """What the tuned side took of each game of the proof, 0 to 1."""
        if self.path.exists():
            self._read()

    @property
    def is_over(self) -> bool:
        """Whether all rounds and the proof were played."""
        return len(self.proof) >= self.settings.proof

    def run(self, on_message: Callable[[str], None]) -> None:
        """Play what is left; `on_message` is called with a sentence after each round, and now and then in the proof."""
        settings = self.settings
        while len(self.scores) < settings.rounds:
            number = len(self.scores)
            up, down = (self._nudged(number, sign) for sign in (1, -1))
            games = [self._game(up, down, f"round {number}", turn) for turn in range(settings.snakes)]
            self.scores.append(float(np.mean(games)))
            self._write()
            on_message(f"round {number + 1} of {settings.rounds}: {self.scores[-1]:.0%}; {_words(self.weights())}")
        tuned = self.weights()
        while not self.is_over:
            number = len(self.proof)
            dice, turn = divmod(number, settings.snakes)
            self.proof.append(self._game(tuned, self.start, f"proof {dice}", turn))
            self._write()
            if self.is_over or len(self.proof) % 20 == 0:
                on_message(f"game {len(self.proof)} of {settings.proof}: {self.gain()}")

    def weights(self) -> Weights:
        """Return the weights found so far: the mean over the second half of the rounds played."""
        way = self._way()
        return _weights(way[len(way) // 2 :].mean(axis=0))

    def gain(self) -> str:
        """Return what the proof says so far."""
        share, low, high = self.proven()
        return f"tuned weights take {share:.1%} against those before (95 %: {low:.1%} to {high:.1%})"

    def proven(self) -> tuple[float, float, float]:
        """Return what share the tuned side took of the proof, draws as halves, with its 95 % interval."""
        took, games = sum(self.proof), len(self.proof)
        return took / max(1, games), *wilson(took, games)

    def _way(self) -> Array:
        """Return the weights after each round, as logarithms, (rounds + 1, 6)."""
        way = [_logs(self.start)]
        steady = PATIENCE * self.settings.rounds
        for number, score in enumerate(self.scores):
            step = STEP * ((1 + steady) / (number + 1 + steady)) ** 0.602
            moved = way[-1] + step * (2 * score - 1) * self._signs(number)
            way.append(np.clip(moved, np.log(LEAST), np.log(MOST)))
        return np.array(way)

    def _nudged(self, number: int, sign: int) -> Weights:
        size = NUDGE / (number + 1) ** 0.101
        return _weights(self._way()[-1] + sign * size * self._signs(number))

    def _signs(self, number: int) -> Array:
        return generator(self.settings.seed, f"gauntlet, nudge {number}").choice([-1.0, 1.0], len(NAMES))

    def _game(self, one: Weights, other: Weights, dice: str, turn: int) -> float:
        """Play one game, every second seat a side, from seat `turn` on; return what the first side took, 0 to 1."""
        settings = self.settings
        sides = [(seat + turn) % 2 for seat in range(settings.snakes)]
        seats = [
            Seat(f"s{seat}", Search(most_walks=settings.effort, weights=(one, other)[side]))
            for seat, side in enumerate(sides)
        ]
        key = int(stream_keys(settings.seed, f"gauntlet, {dice}, {turn // 2}", 1)[0])
        played = play(settings.game, seats, StreamDice(key), timeout_ms=NO_HURRY_MS, most_turns=settings.most_turns)
        places = played.places()
        best = [side for side, place in zip(sides, places, strict=True) if place == 0]
        return 1.0 - sum(best) / len(best)

    def _read(self) -> None:
        kept: Any = read_weights_file(self.path).get("gauntlet")
        try:
            header = {"settings": asdict(self.settings), "start": asdict(self.start)}
            found = {name: kept[name] for name in header}
            self.scores, self.proof = ([float(one) for one in kept[name]] for name in ("scores", "proof"))
        except (TypeError, KeyError, ValueError) as problem:
            raise InputFileError(
                self.path, "weights of which no gauntlet tells", "a gauntlet's file, or a new one",
                "Give another file; these weights may be what it begins with (--from).",
            ) from problem  # fmt: skip
        if found != header:
            raise InputFileError(
                self.path,
                Message("another gauntlet ({differences})", differences=_differences(header, found)),
                "the same one to go on with",
                "Give another file, or the same settings.",
            )

    def _write(self) -> None:
        share, low, high = self.proven()
        kept: dict[str, Any] = {
            "settings": asdict(self.settings), "start": asdict(self.start), "scores": self.scores, "proof": self.proof,
        }  # fmt: skip
        proven = {"games": len(self.proof), "share": share, "low": low, "high": high}
        write_atomic(self.path, weights_text(self.weights(), {"proven": proven, "gauntlet": kept}))


def _logs(weights: Weights) -> Array:
    return np.log(np.maximum([getattr(weights, name) for name in NAMES], LEAST))


def _weights(logs: Array) -> Weights:
    """Return weights of logarithms; the first three add up to 1."""
    found = np.minimum(np.exp(logs), MOST)
    found[:3] /= found[:3].sum()
    return weights_in(dict(zip(NAMES, np.round(found, 4).tolist(), strict=True)))


def _words(weights: Weights) -> str:
    return ", ".join(f"{name} {value:.3g}" for name, value in asdict(weights).items())


def _differences(header: dict[str, Any], found: dict[str, Any]) -> str:
    differences = []
    for part in header:
        there = found[part] if isinstance(found[part], dict) else {}
        differences += [
            f"{name} {there.get(name)}, now {value}" for name, value in header[part].items() if there.get(name) != value
        ]
    return "; ".join(differences)
