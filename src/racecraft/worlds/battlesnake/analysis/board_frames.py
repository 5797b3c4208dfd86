"""A game as the official board draws it (facts: A.11): what `GET /games/{id}` says, and an event for every position.

These keys are capitalised, unlike those of the webhook API. Our own page (`board_page.py`) reads the same events.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from PIL import ImageColor

from racecraft.worlds.battlesnake.env.board import Board, Point, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.messages import LOOKS, GameCard

COLOURS = ("#2a9d8f", "#e76f51", "#7b2cbf", "#e9c46a", "#277da1", "#d62828", "#90be6d", "#6d597a")
"""Colours of snakes that did not choose one, in seat order."""

Event = dict[str, Any]
"""{"Type": "frame" or "game_end", "Data": …}"""


def colours_of(ids: Sequence[str], card: GameCard) -> dict[str, str]:
    """Return a colour (#rrggbb) for every snake: its own, or one of ours where it has the default or none we can read.

    >>> colours_of(["a"], GameCard("g", appearances={"a": {"color": "no colour"}}))
    {'a': '#2a9d8f'}
    """
    found = {}
    for number, one in enumerate(ids):
        colour = card.appearances.get(one, {}).get("color", LOOKS["color"])
        try:
            plain = "#{:02x}{:02x}{:02x}".format(*ImageColor.getrgb(colour)[:3])
        except (ValueError, AttributeError, TypeError):
            plain = LOOKS["color"]
        found[one] = COLOURS[number % len(COLOURS)] if plain == LOOKS["color"] else plain
    return found


def title_of(card: GameCard) -> str:
    """Return a headline: who plays.

    >>> title_of(GameCard("g", names={"s0": "Flo", "s1": "Sam"}))
    'Flo – Sam'
    """
    names = list(card.names.values())
    return " – ".join(names if len(names) <= 4 else [*names[:3], f"{len(names) - 3} more"])


def game_facts(settings: GameSettings, card: GameCard, status: str = "running") -> dict[str, Any]:
    """Return what the board asks first: the game's size, rules and time; `status` is running or complete."""
    ruleset = {
        "name": settings.ruleset,
        "foodSpawnChance": str(settings.food_spawn_chance),
        "minimumFood": str(settings.minimum_food),
        "damagePerTurn": str(settings.hazard_damage),
        "shrinkEveryNTurns": str(settings.shrink_every),
    }
    return {
        "ID": card.id,
        "Status": status,
        "Width": settings.width,
        "Height": settings.height,
        "Ruleset": ruleset,
        "SnakeTimeout": card.timeout_ms,
        "Source": card.source,
        "RulesetName": settings.ruleset,
        "RulesStages": [],
        "Map": settings.map,
    }


def frame(board: Board, card: GameCard) -> Event:
    """Return the event of a position: every snake, the eliminated where they died."""
    colours = colours_of([snake.id for snake in board.snakes], card)
    hazards = [point for point, count in sorted(board.hazards.items()) for _ in range(count) if board.holds(point)]
    data = {
        "Turn": board.turn,
        "Snakes": [_snake(snake, card, colours[snake.id]) for snake in board.snakes],
        "Food": _points(board.food),
        "Hazards": _points(hazards),
    }
    return {"Type": "frame", "Data": data}


def game_end(settings: GameSettings, card: GameCard) -> Event:
    """Return the event after the last frame."""
    return {"Type": "game_end", "Data": game_facts(settings, card, "complete")}


def _snake(snake: Snake, card: GameCard, colour: str) -> dict[str, Any]:
    looks = card.appearances.get(snake.id, LOOKS)
    death = {"Cause": snake.cause, "Turn": snake.on, "EliminatedBy": snake.by}
    return {
        "ID": snake.id,
        "Name": card.names.get(snake.id, snake.id),
        "Body": _points(snake.body),
        "Health": snake.health,
        "Death": None if snake.alive else death,
        "Color": colour,
        "HeadType": looks.get("head") or LOOKS["head"],
        "TailType": looks.get("tail") or LOOKS["tail"],
        "Latency": str(card.latencies_ms.get(snake.id, 0)),
        "Shout": "",
        "Squad": "",
        "Author": "",
        "StatusCode": 200,
        "Error": "",
        "IsBot": False,
        "IsEnvironment": False,
    }


def _points(points: Iterable[Point]) -> list[dict[str, int]]:
    return [{"X": x, "Y": y} for x, y in points]
