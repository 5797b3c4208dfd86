"""The games of a tournament on the disk, so that one that was broken off goes on: JSON Lines.

    {"tournament": 1, "players": […], "game": {…}, "timeout_ms": 100, "seed": 0, "most_turns": 1000}
    {"number": 1, "players": [0, 1], "places": [0, 1], "turns": 87, "timeouts": [0, 0], "crashes": [0, 0]}

The first line says what is played (`rounds` is not in it: a tournament may be given more), then comes a line a game. A
last line that was cut while it was written is written anew.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.formats.atomic import append_atomic, write_atomic
from racecraft.formats.user_file import read_regular
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.standings import GameResult

VERSION = 1
_EXPECTED = "the file of `snakes tournament --file`"
_FIELDS = ("number", "players", "places", "turns", "timeouts", "crashes")


class TournamentFile:
    """Where the games of one tournament are kept.

    Args:
        path: The file; begun where there is none.
        players: Names of the players, in their order.
        settings: What is played.
        timeout_ms: Time for an answer.
        seed: Chance of all games.
        most_turns: A longer game is a draw.

    Raises:
        InputFileError: The file is none, or another tournament's: says in what it differs.
        OutputFileError: It cannot be written.
    """

    def __init__(
        self, path: str | Path, players: list[str], settings: GameSettings, timeout_ms: int, seed: int, most_turns: int
    ) -> None:
        self.path = Path(path)
        header = {
            "tournament": VERSION, "players": players, "game": asdict(settings), "timeout_ms": timeout_ms,
            "seed": seed, "most_turns": most_turns,
        }  # fmt: skip
        self.games: list[GameResult] = []
        """The games that stand in the file, in order."""
        if not self.path.exists():
            head = _line(header)
            write_atomic(self.path, head)
            self._sound = len(head)
            return
        self._sound = self._read(header)

    def add(self, game: GameResult) -> None:
        """Write a game down."""
        self._sound = append_atomic(self.path, self._sound, _line({name: getattr(game, name) for name in _FIELDS}))

    def _read(self, header: dict[str, Any]) -> int:
        """Take over what stands there; return how many bytes of it are whole lines."""
        try:
            data = read_regular(self.path)
        except OSError as problem:
            raise InputFileError(
                self.path, Message("the file cannot be read ({strerror})", strerror=problem.strerror), _EXPECTED
            ) from problem
        whole = data[: data.rfind(b"\n") + 1]
        for number, text in enumerate(whole.splitlines(), 1):
            try:
                line = json.loads(text)
                if number > 1:
                    self.games.append(_game(line, number - 1, len(header["players"])))
                    continue
                found = {name: line[name] for name in header}
            except (ValueError, KeyError, TypeError, RecursionError) as problem:
                raise InputFileError(
                    self.path, Message("{problem!r:.120}", problem=problem), _EXPECTED, line=number
                ) from problem
            self._compare(header, found)
        if not whole:
            raise InputFileError(self.path, "no line in it", _EXPECTED)
        return len(whole)

    def _compare(self, header: dict[str, Any], found: dict[str, Any]) -> None:
        other = [f"{name} {found[name]}, now {header[name]}" for name in header if found[name] != header[name]]
        if other:
            raise InputFileError(
                self.path,
                Message("another tournament ({other})", other="; ".join(other)),
                "the same one to go on with",
                "Give the tournament another --file, or the same players and settings.",
            )


def _game(line: Any, number: int, players: int) -> GameResult:
    values = {name: line[name] for name in _FIELDS}
    for name in ("players", "places", "timeouts", "crashes"):
        if not all(isinstance(one, int) and one >= 0 for one in values[name]):
            raise ValueError(f"{name} {values[name]}")
        values[name] = tuple(values[name])
    sizes = {len(values[name]) for name in ("players", "places", "timeouts", "crashes")}
    if values["number"] != number or len(sizes) != 1 or not isinstance(values["turns"], int):
        raise ValueError(f"game {values['number']} where game {number} belongs")
    if len(set(values["players"])) < 2 or max(values["players"]) >= players:
        raise ValueError(f"players {values['players']} of {players}")
    return GameResult(**values)


def _line(value: dict[str, Any]) -> bytes:
    return (json.dumps(value, separators=(",", ":")) + "\n").encode()
