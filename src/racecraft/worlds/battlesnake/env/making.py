"""A world of snakes from plain words, for `rc.make_world`."""

from __future__ import annotations

import dataclasses
from typing import Any

from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld, WorldSettings


def make_world(**words: Any) -> BattlesnakeWorld:
    """Return snakes on a board; words are fields of `GameSettings` and of `WorldSettings`."""
    of_game = {field.name for field in dataclasses.fields(GameSettings)}
    game = GameSettings(**{name: value for name, value in words.items() if name in of_game})
    return BattlesnakeWorld(
        WorldSettings(game, **{name: value for name, value in words.items() if name not in of_game})
    )
