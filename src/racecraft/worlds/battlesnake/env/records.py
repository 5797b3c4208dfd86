"""Recorded games: JSON Lines in gzip, one `game` line, then a `step` line per turn, then perhaps `over`.

The file's own description stands in its README; the keys read here:

    game   w, h, ruleset, map, damage, shrink, chance, min, solo, snakes, food, hazards: the position at turn 0
    step   turn (before the step), moves, food_pre, haz_pre (before the rules), snakes, food_rules, haz_rules (after
           the rules), food, hazards (after the map), snakes_post (only where the map changed the snakes)
    over   turn at which the game was found over
"""

from __future__ import annotations

import gzip
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.formats.json_text import parse_json
from racecraft.formats.user_file import regular
from racecraft.worlds.battlesnake.env.board import CAUSES, Board, BoardError, Point, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings

Line = dict[str, Any]


@dataclass
class RecordedStep:
    """One recorded turn."""

    moves: dict[str, str]
    before: Board
    """The position the rules were given."""
    after_rules: Board
    """The position the rules left; turn not yet counted up."""
    after_map: Board
    """The position the next turn begins with."""


@dataclass
class RecordedGame:
    """One recorded game."""

    line: int
    """Where it begins in the file, counted from 1."""
    settings: GameSettings
    start: Board
    steps: list[RecordedStep] = field(default_factory=list)
    over_turn: int | None = None
    """The turn whose position was found over; None where the record was cut."""
    missing_turn: int | None = None
    """The first turn that a file of positions lacks; what comes after it there is not among the steps."""


def read_games(path: Path) -> Iterator[RecordedGame]:
    """Yield the games of a record, in order.

    Raises:
        InputFileError: The file is not such a record; names the line and the key.
    """
    game: RecordedGame | None = None
    for number, line in _lines(path):
        try:
            kind = line["t"]
            if kind == "game":
                if game is not None:
                    yield game
                game = _game(number, line)
            elif game is None:
                raise InputFileError(
                    path, Message("a '{kind}' line before any game", kind=kind), "a 'game' line first", line=number
                )
            elif kind == "step":
                game.steps.append(_step(game, line))
            elif kind == "over":
                game.over_turn = _whole(line["turn"])
        except (KeyError, TypeError, ValueError, IndexError, AttributeError, BoardError) as problem:
            found = Message("{type_name}: {problem}", type_name=type(problem).__name__, problem=problem)
            raise InputFileError(
                path, found, "a line as described in racecraft's battlesnake docs", line=number
            ) from problem
    if game is None:
        raise InputFileError(path, "no game in it", "JSON Lines with at least one 'game' line")
    yield game


def _lines(path: Path) -> Iterator[tuple[int, Line]]:
    opener = gzip.open if path.suffix == ".gz" else open
    try:
        with opener(regular(path), "rt", encoding="utf-8") as file:
            for number, text in enumerate(file, 1):
                line = parse_json(text)
                if not isinstance(line, dict):
                    raise InputFileError(
                        path,
                        Message("a {type_name}", type_name=type(line).__name__),
                        "a JSON object a line",
                        line=number,
                    )
                yield number, line
    except (OSError, EOFError, ValueError) as problem:
        raise InputFileError(path, str(problem), "JSON Lines, gzipped where the name ends in .gz") from problem


def _game(number: int, line: Line) -> RecordedGame:
    settings = GameSettings(
        width=_whole(line["w"]),
        height=_whole(line["h"]),
        players=len(line["snakes"]),
        ruleset=str(line["ruleset"]),
        map=str(line["map"]),
        food_spawn_chance=_whole(line["chance"]),
        minimum_food=_whole(line["min"]),
        hazard_damage=_whole(line["damage"]),
        shrink_every=_whole(line["shrink"]),
        solo=bool(line["solo"]),
    )
    start = _board(settings, 0, line["snakes"], line["food"], line["hazards"])
    return RecordedGame(number, settings, start)


def _step(game: RecordedGame, line: Line) -> RecordedStep:
    settings, turn = game.settings, _whole(line["turn"])
    last = game.steps[-1].after_map if game.steps else game.start
    before = last.copy()
    before.turn, before.food, before.hazards = turn, _points(line["food_pre"]), Counter(_points(line["haz_pre"]))
    after_rules = _board(settings, turn, line["snakes"], line["food_rules"], line["haz_rules"])
    snakes = line["snakes_post"] if "snakes_post" in line else line["snakes"]
    after_map = _board(settings, turn + 1, snakes, line["food"], line["hazards"])
    moves = {str(name): str(word) for name, word in line["moves"].items()}
    return RecordedStep(moves, before, after_rules, after_map)


def _board(settings: GameSettings, turn: int, snakes: list[Line], food: list[Any], hazards: list[Any]) -> Board:
    bodies = [_snake(snake) for snake in snakes]
    return Board(settings.width, settings.height, turn, bodies, _points(food), Counter(_points(hazards)))


def _snake(line: Line) -> Snake:
    cause = line["cause"]
    if cause not in CAUSES:
        raise ValueError(f"cause {cause!r}; expected one of {CAUSES}")
    body = _points(line["body"])
    return Snake(str(line["id"]), body, _whole(line["health"]), cause, str(line["by"]), _whole(line["on"]))


def _points(pairs: list[Any]) -> list[Point]:
    return [(_whole(x), _whole(y)) for x, y in pairs]


def _whole(value: Any) -> int:
    if not isinstance(value, int) or abs(value) > 1_000_000:
        raise ValueError(f"{value!r}; expected a whole number within a million")
    return int(value)
