"""What engines tell of a game in frames: the production engine, the board protocol, and the arena of 2026.

    {"Game": …}                       size, and with the production engine the rules (`/games/ID`)
    {"Count": …, "Frames": [ … ]}     a page of frames (`/games/ID/frames`); the arena writes `count` and `frames`
    {"game_type": …, "board": "11x11", "frames": [ … ]}       the arena's `/api/games/ID/details`, all in one
    {"Type": "frame", "Data": …}      an event; the last is "game_end", with the `Game` or, from the arena, with nothing

They may come in one file, one after another, or in several. The arena's `Game` tells no rules: they follow from the
`game_type` of the details, and are standard without them. Facts: battlesnake-arena.md.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError, nearest
from racecraft.contract.message import Message
from racecraft.worlds.battlesnake.env.board import CAUSES, MAX_HEALTH, Board, BoardError, Point, Snake
from racecraft.worlds.battlesnake.env.maps import MAPS, pending_trails
from racecraft.worlds.battlesnake.env.records import RecordedGame
from racecraft.worlds.battlesnake.env.rulesets import RULESETS
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.transcript import Frame, recorded_game

FARTHEST = 1000
"""Squares from the origin; hazards and the dead may lie off the board."""
PIECES = (
    "the engine's answers for one game: {'Game': …} of /games/ID and one or more {'Frames': …} of /games/ID/frames, or "
    "the arena's /details, in one file or given together to `snakes import`"
)
_ARENA_CAUSES = {"self-collision": "snake-self-collision"}
_GAME_TYPES: dict[str, dict[str, Any]] = {
    "standard": {},
    "royale": {"ruleset": "royale"},
    "constrictor": {"ruleset": "constrictor", "food_spawn_chance": 0, "minimum_food": 0},
    "snail": {"map": "snail_mode"},
    "solo": {"ruleset": "solo"},
}
"""Settings of the arena's game types beside the defaults."""


@dataclass
class Pieces:
    """What files tell of one game."""

    game: dict[str, Any] = field(default_factory=dict)
    """The engine's `Game`."""
    details: dict[str, Any] = field(default_factory=dict)
    """The arena's details, without frames."""
    frames: list[Any] = field(default_factory=list)
    is_over: bool | None = None
    """Whether a `game_end` came; None: nothing says so."""

    def add(self, value: dict[str, Any], path: Path) -> bool:
        """Take one JSON object; tell whether it is a piece of a game.

        Raises:
            InputFileError: It is of another game than those before.
        """
        frames = value.get("Frames", value.get("frames"))
        if isinstance(value.get("Game"), dict):
            self._same(self.game.get("ID"), value["Game"].get("ID"), path)
            self.game = value["Game"]
        elif value.get("Type") == "frame":
            self.frames.append(value["Data"])
        elif value.get("Type") == "game_end":
            data = value.get("Data") or {}
            self.is_over, self.game = True, self.game or data.get("game") or data
        elif isinstance(frames, list):
            if "game_type" in value:
                self.details = value
        else:
            return False
        if isinstance(frames, list):
            self.frames += frames
        return True

    def _same(self, before: Any, now: Any, path: Path) -> None:
        if self.game and before != now:
            raise InputFileError(
                path,
                Message("game '{now!s:.60}' beside game '{before!s:.60}'", now=now, before=before),
                "pieces of one game",
            )

    def recorded(self, path: Path) -> RecordedGame:
        """Return the game: every snake in every frame, the dead where and how they died.

        Raises:
            InputFileError: The frames or the size are missing; says which.
            BoardError: A ruleset or map is unknown.
            KeyError, TypeError, ValueError, IndexError: A piece is malformed.
        """
        if not self.frames or not (self.game or self.details):
            found = "no frames" if self.game or self.details else "no Game or details that say size and rules"
            raise InputFileError(path, found, PIECES)
        settings = self._settings(len(self.frames[0]["Snakes"]))
        frames = sorted((_frame(frame, settings) for frame in self.frames), key=lambda frame: frame.board.turn)
        if settings.map == "snail_mode":
            _add_pending_trails(frames)
        over = self.is_over
        if over is None:
            over = self.game.get("Status") == "complete" or self.details.get("status") in ("finished", "complete")
        return recorded_game(settings, frames, over)

    def _settings(self, players: int) -> GameSettings:
        game, rules = self.game, self.game.get("Ruleset") or {}
        width, height = (game["Width"], game["Height"]) if game else str(self.details["board"]).split("x")
        solo = True if players == 1 else None
        if self.details and not rules:
            kind = str(self.details["game_type"]).lower().split()[0]
            settings = _GAME_TYPES[known(kind, _GAME_TYPES, "game type")]
            return GameSettings(int(width), int(height), players, **settings, solo=solo)
        name = str(game.get("RulesetName") or rules.get("name") or "standard")
        return GameSettings(
            width=int(width), height=int(height), players=players,
            ruleset=known(name, RULESETS, "ruleset"), map=known(str(game.get("Map") or "standard"), MAPS, "map"),
            food_spawn_chance=int(rules.get("foodSpawnChance", 15)), minimum_food=int(rules.get("minimumFood", 1)),
            hazard_damage=int(rules.get("damagePerTurn", 14)), shrink_every=int(rules.get("shrinkEveryNTurns", 25)),
            solo=solo,
        )  # fmt: skip


def dead_snake(name: Any, body: Any, keys: str, cause: Any, turn: Any) -> Snake:
    """Return a snake that left; `keys` are the names of a square's two numbers. Raises ValueError."""
    cause = _ARENA_CAUSES.get(cause, cause)
    if cause not in CAUSES or not cause:
        raise ValueError(f"cause {cause!r:.40}; expected one of {', '.join(CAUSES[1:])}")
    return Snake(str(name), _points(body, keys), 0, cause, "", int(turn))


def known(name: str, names: Iterable[str], what: str) -> str:
    """Return a name that is known. Raises BoardError with the nearest known one."""
    if name not in names:
        raise BoardError(
            "There is no {what} '{name}'. {hint}", what=what, name=name[:40], hint=nearest(name, list(names))
        )
    return name


def _frame(data: dict[str, Any], settings: GameSettings) -> Frame:
    living, dead = [], {}
    for part in data["Snakes"]:
        death = part.get("Death")
        if death:
            cause, turn = death["Cause"], int(death.get("Turn") or 0)
            dead[part["ID"]] = dead_snake(part["ID"], part["Body"], "XY", cause, turn)
        else:
            living.append(Snake(str(part["ID"]), _points(part["Body"], "XY"), _health(part["Health"])))
    food, hazards = _points(data["Food"] or [], "XY"), Counter(_points(data["Hazards"] or [], "XY"))
    board = Board(settings.width, settings.height, int(data["Turn"]), living, food, hazards)
    for square in (*food, *(square for snake in living for square in snake.body)):
        if not board.holds(square):
            raise ValueError(f"food or a living snake at {square}; expected squares of the board")
    return Frame(board, dead)


def _add_pending_trails(frames: list[Frame]) -> None:
    """Add the squares that will become trails on the next turn, where the engine tells hazards on the board alone."""
    if not any(not frame.board.holds(square) for frame in frames for square in frame.board.hazards):
        for frame in frames:
            frame.board.hazards += pending_trails(frame.board)


def _points(parts: Any, keys: str) -> list[Point]:
    points = [(int(part[keys[0]]), int(part[keys[1]])) for part in parts]
    if any(abs(x) > FARTHEST or abs(y) > FARTHEST for x, y in points):
        raise ValueError(f"a square beyond {FARTHEST}")
    return points


def _health(value: Any) -> int:
    if not 0 <= int(value) <= MAX_HEALTH:
        raise ValueError(f"health {value}; expected 0 to {MAX_HEALTH}")
    return int(value)
