"""What counts how much where search appraises a position (`kernels/worth.py`), and the file that keeps it.

    {"format": "racecraft snake weights", "version": 1, "weights": {"squares": 0.6, …}, …}

What else stands in the file is for whoever made it (`league/spsa.py`), and passed over here.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError, SettingError, nearest
from racecraft.contract.message import Message
from racecraft.formats.json_text import parse_json
from racecraft.formats.user_file import read_regular
from racecraft.worlds.battlesnake.players.kernels.position import WEIGHT_SCALE

FORMAT, VERSION = "racecraft snake weights", 1
_EXPECTED = "weights that `racecraft snakes tune` wrote"


@dataclass(frozen=True)
class Weights:
    """What counts how much; each from 0 to 1, and of the first three only their ratio matters.

    Raises:
        SettingError: One is out of its range, or the first three are all 0.
    """

    squares: float = 0.6
    """The share of the squares that are reached first."""
    length: float = 0.2
    """The share of all lengths."""
    meal: float = 0.2
    """How sure the next meal is."""
    health: float = 0.6
    """Share of health in how sure a meal is; the rest is how near food is."""
    room: float = 0.7
    """How much is lost where the body has no room: all of it at 1."""
    burn: float = 0.003
    """What is lost for each point of damage that a hazard under the head does."""

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= 1:
                raise SettingError(
                    "weight {name} is {value!r:.40}; expected a number from 0 to 1.", name=name, value=value
                )
        if not self.squares + self.length + self.meal > 0:
            raise SettingError("weights squares, length and meal are all 0; expected one that is more.")

    def parts(self) -> tuple[int, ...]:
        """Return them as the kernel reads them, in parts of WEIGHT_SCALE.

        >>> Weights().parts()
        (6000, 2000, 2000, 6000, 7000, 30)
        """
        total = self.squares + self.length + self.meal
        shares = self.squares / total, self.length / total, self.meal / total
        return tuple(round(WEIGHT_SCALE * one) for one in (*shares, self.health, self.room, self.burn))


DEFAULT_WEIGHTS = Weights()
"""Those that search has in a duel without a file."""
AMONG_SEVERAL = Weights(squares=0.4, length=0.4, meal=0.2)
"""Those among more, where squares are soon lost again and whoever is longer takes the food."""


def default_weights(snakes: int) -> Weights:
    """Return the weights that search has without a file where so many snakes are alive."""
    return DEFAULT_WEIGHTS if snakes <= 2 else AMONG_SEVERAL


def weights_in(values: Mapping[str, Any]) -> Weights:
    """Return the weights that a mapping names; what it does not name is as usual.

    Raises:
        SettingError: There is no such weight, or one is out of its range.
    """
    names = [field.name for field in fields(Weights)]
    for name in values:
        if name not in names:
            raise SettingError("There is no weight '{name}'. {hint}", name=name, hint=nearest(name, names))
    return Weights(**values)


def read_weights(path: str | Path) -> Weights:
    """Read a file of weights.

    Raises:
        InputFileError: It cannot be read, or is none; says what is wrong.
    """
    document = read_weights_file(path)
    try:
        return weights_in(document["weights"])
    except SettingError as problem:
        raise InputFileError(path, str(problem).rstrip("."), _EXPECTED) from problem


def read_weights_file(path: str | Path) -> dict[str, Any]:
    """Return all that a file of weights says. Raises what `read_weights` raises."""
    try:
        document = parse_json(read_regular(path))
    except OSError as problem:
        raise InputFileError(
            path, Message("the file cannot be read ({strerror})", strerror=problem.strerror), _EXPECTED
        ) from problem
    except (ValueError, RecursionError) as problem:
        raise InputFileError(path, Message("no JSON ({problem})", problem=str(problem)[:80]), _EXPECTED) from problem
    if (
        not isinstance(document, dict)
        or document.get("format") != FORMAT
        or not isinstance(document.get("weights"), dict)
    ):
        raise InputFileError(path, "another kind of file", _EXPECTED)
    if document.get("version") != VERSION:
        raise InputFileError(
            path,
            Message("version {told!r:.20}", told=document.get("version")),
            Message("version {version}", version=VERSION),
        )
    return document


def weights_text(weights: Weights, more: Mapping[str, Any]) -> str:
    """Return what a file of weights holds; `more` is what its maker keeps there."""
    document = {"format": FORMAT, "version": VERSION, "weights": asdict(weights), **more}
    return json.dumps(document, indent=1) + "\n"
