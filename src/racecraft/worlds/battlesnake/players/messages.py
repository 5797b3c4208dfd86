"""The official JSON of the webhook API, both ways (facts: A.10): what an engine sends, and what a snake reads in it.

`message` tells one snake a position; `read_message` reads such a message and refuses what cannot be a position.
It is not narrow about the game around it: an engine may know rulesets, maps and figures that we do not, and a snake has
to move all the same. What it does not know it reads as the official engine does: as standard. In snail mode an engine
that tells hazards on the board alone leaves out which squares the next turn's trails are on; they are added.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from racecraft.worlds.battlesnake.env.board import MAX_HEALTH, Board, BoardError, Point, Snake
from racecraft.worlds.battlesnake.env.maps import MAPS, pending_trails
from racecraft.worlds.battlesnake.env.rulesets import RULESETS
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.protocol import Message

LOOKS = {"color": "#888888", "head": "default", "tail": "default"}
"""How a snake looks that does not say."""
RULESET_VERSION = "cli"
MAX_SEGMENTS = 25 * 25 + 3
MAX_STACKED = 1000


class MessageError(BoardError):
    """A message holds no position that could be played."""


@dataclass
class GameCard:
    """What a message says of a game besides the board and its settings."""

    id: str
    timeout_ms: int = 500
    """Time for an answer, the way there and back included."""
    names: dict[str, str] = field(default_factory=dict)
    """Names of the snakes by id."""
    appearances: dict[str, dict[str, str]] = field(default_factory=dict)
    """Colour, head and tail by id."""
    latencies_ms: dict[str, int] = field(default_factory=dict)
    """How long each snake's last answer took, by id."""
    source: str = ""


@dataclass(frozen=True)
class GameRequest:
    """A message, read."""

    game_id: str
    you: str
    """Id of the snake that is asked."""
    timeout_ms: int
    board: Board
    settings: GameSettings


def game_part(card: GameCard, settings: GameSettings) -> Message:
    """Return the `game` part of a message: also the first line of the official output file."""
    return {
        "id": card.id,
        "ruleset": {
            "name": settings.ruleset,
            "version": RULESET_VERSION,
            "settings": {
                "foodSpawnChance": settings.food_spawn_chance,
                "minimumFood": settings.minimum_food,
                "hazardDamagePerTurn": settings.hazard_damage,
                "hazardMap": "",
                "hazardMapAuthor": "",
                "royale": {"shrinkEveryNTurns": settings.shrink_every},
                "squad": {
                    "allowBodyCollisions": False,
                    "sharedElimination": False,
                    "sharedHealth": False,
                    "sharedLength": False,
                },
            },
        },
        "map": settings.map,
        "timeout": card.timeout_ms,
        "source": card.source,
    }


def message(board: Board, settings: GameSettings, you: str, card: GameCard) -> Message:
    """Return what one snake is told; eliminated snakes are left out of the board, `you` may be one of them."""
    asked = next(snake for snake in board.snakes if snake.id == you)
    hazards = [point for point, count in sorted(board.hazards.items()) for _ in range(count)]
    return {
        "game": game_part(card, settings),
        "turn": board.turn,
        "board": {
            "height": board.height,
            "width": board.width,
            "snakes": [_snake_part(snake, card) for snake in board.alive()],
            "food": [_point_part(point) for point in board.food],
            "hazards": [_point_part(point) for point in hazards],
        },
        "you": _snake_part(asked, card),
    }


def read_message(data: Any) -> GameRequest:
    """Take a message apart.

    An unknown ruleset is played as standard (wrapped, where its name says so), an unknown map as standard; figures of
    the rules beyond their range count as the nearest one, which for damage is the same: health has 100 points.

    Raises:
        MessageError: Something in it is missing, is of a wrong kind, or cannot be; the message names it.
    """
    game, board_part = _part(data, "game", dict), _part(data, "board", dict)
    ruleset = _part(game, "ruleset", dict, {}, "game.")
    name = _part(ruleset, "name", str, "standard", "game.ruleset.")
    width, height = _whole(board_part, "width", "board."), _whole(board_part, "height", "board.")
    you_part = _part(data, "you", dict)
    snakes = [read_snake(part, f"board.snakes[{n}]") for n, part in enumerate(_part(board_part, "snakes", list))]
    settings = _read_settings(name, game, width, height, len(snakes))
    board = Board(width, height, _whole(data, "turn", "", 0), snakes)
    board.food = [read_point(part, "board.food") for part in _part(board_part, "food", list, [], "board.")]
    hazards = _part(board_part, "hazards", list, [], "board.")
    board.hazards = Counter(read_point(part, "board.hazards") for part in hazards)
    if settings.map == "snail_mode" and all(board.holds(square) for square in board.hazards):
        board.hazards += pending_trails(board)
    _check(board)
    you = _part(you_part, "id", str, None, "you.")
    game_id = _part(game, "id", str, None, "game.")
    timeout = _whole(game, "timeout", "game.", 500)
    return GameRequest(game_id, you, timeout, board, settings)


def _snake_part(snake: Snake, card: GameCard) -> Message:
    body = [_point_part(point) for point in snake.body]
    return {
        "id": snake.id,
        "name": card.names.get(snake.id, snake.id),
        "latency": str(card.latencies_ms.get(snake.id, 0)),
        "health": snake.health,
        "body": body,
        "head": body[0],
        "length": len(body),
        "shout": "",
        "squad": "",
        "customizations": card.appearances.get(snake.id, LOOKS),
    }


def _point_part(point: Point) -> dict[str, int]:
    return {"x": point[0], "y": point[1]}


def _read_settings(name: str, game: Message, width: int, height: int, players: int) -> GameSettings:
    ruleset = _part(game, "ruleset", dict, {}, "game.")
    numbers = _part(ruleset, "settings", dict, {}, "game.ruleset.")
    royale = _part(numbers, "royale", dict, {}, "game.ruleset.settings.")
    map_name = _part(game, "map", str, "standard", "game.") or "standard"
    where = "game.ruleset.settings."
    return GameSettings(
        width=width,
        height=height,
        players=max(1, players),
        ruleset=_known_ruleset(name),
        map=map_name if map_name in MAPS else "standard",
        food_spawn_chance=_within(0, _whole(numbers, "foodSpawnChance", where, 15), 100),
        minimum_food=_within(0, _whole(numbers, "minimumFood", where, 1), width * height),
        hazard_damage=_within(-MAX_HEALTH, _whole(numbers, "hazardDamagePerTurn", where, 14), MAX_HEALTH),
        shrink_every=_within(0, _whole(royale, "shrinkEveryNTurns", where + "royale.", 25), 1_000_000),
    )


def _known_ruleset(name: str) -> str:
    if name in RULESETS:
        return name
    return "wrapped" if name.startswith("wrapped") else "standard"


def _within(low: int, value: int, high: int) -> int:
    return max(low, min(value, high))


def read_snake(part: Any, where: str) -> Snake:
    """Return the snake of one part of `board.snakes`; `where` names it in errors. Raises MessageError."""
    body = [read_point(point, f"{where}.body") for point in _part(part, "body", list, None, f"{where}.")]
    if not 1 <= len(body) <= MAX_SEGMENTS:
        raise MessageError(
            "{where}.body has {count} squares; expected 1 to {most_segments}.",
            where=where,
            count=len(body),
            most_segments=MAX_SEGMENTS,
        )
    health = _whole(part, "health", f"{where}.")
    if not 0 <= health <= MAX_HEALTH:
        raise MessageError(
            "{where}.health is {health}; expected 0 to {max_health}.", where=where, health=health, max_health=MAX_HEALTH
        )
    return Snake(_part(part, "id", str, None, f"{where}."), body, health)


def _check(board: Board) -> None:
    ids = [snake.id for snake in board.snakes]
    if len(set(ids)) < len(ids):
        raise MessageError("two snakes of board.snakes have the same id; expected each once.")
    for snake in board.snakes:
        for point in snake.body:
            if not board.holds(point):
                raise MessageError(
                    "snake '{id}' at {point}; expected squares of the board.", id=snake.id[:40], point=point
                )
    for point in board.food:
        if not board.holds(point):
            raise MessageError("food at {point}; expected squares of the board.", point=point)
    if any(count > MAX_STACKED for count in board.hazards.values()):
        raise MessageError("board.hazards stacks more than {most_stacked} on a square.", most_stacked=MAX_STACKED)


def read_point(part: Any, where: str) -> Point:
    """Return the square {"x", "y"}; `where` names it in errors. Raises MessageError."""
    return _whole(part, "x", f"{where}."), _whole(part, "y", f"{where}.")


def _whole(part: Any, key: str, where: str, default: int | None = None) -> int:
    value = _part(part, key, int, default, where)
    if isinstance(value, bool) or abs(value) > 1_000_000_000:
        raise MessageError(
            "{where}{key} is {value}; expected a whole number.", where=where, key=key, value=str(value)[:40]
        )
    return int(value)


def _part(part: Any, key: str, kind: type, default: Any = None, where: str = "") -> Any:
    if not isinstance(part, dict):
        raise MessageError(
            "{where} is {kind_of}; expected an object.",
            where=where.rstrip(".") or "the message",
            kind_of=_kind_of(part),
        )
    value = part.get(key, default)
    if value is None:
        raise MessageError("{where}{key} is missing; expected {kinds}.", where=where, key=key, kinds=_KINDS[kind])
    if not isinstance(value, kind):
        raise MessageError(
            "{where}{key} is {kind_of}; expected {kinds}.",
            where=where,
            key=key,
            kind_of=_kind_of(value),
            kinds=_KINDS[kind],
        )
    return value


_KINDS = {dict: "an object", list: "a list", str: "a text", int: "a whole number"}


def _kind_of(value: Any) -> str:
    return _KINDS.get(type(value), "null" if value is None else f"a {type(value).__name__}")
