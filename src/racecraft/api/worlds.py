"""A world to step by hand: arrays in, arrays out, as `racecraft.contract.world` promises."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.world import World

KINDS = ("deepracer", "battlesnake", "gymnasium", "unity")


def make_world(kind: str, **words: Any) -> World:
    """Return a world of a kind.

    Args:
        kind: "deepracer" (`track`, `actions` in degrees and m/s, `reward`, `num_cars`, and `RaceWorld`'s own words),
            "battlesnake" (`BattlesnakeWorld`'s `WorldSettings`, and `width`, `height`, `players`, `ruleset`, `map` of
            the game), "gymnasium" (`environment`, `num_worlds`) or "unity" (`build`, and `UnityWorld`'s own words).
        words: What that kind of world is made of.

    Raises:
        SettingError: There is no such kind.
        UserInputError: Something given cannot be used.
    """
    makers: dict[str, Callable[..., World]] = {
        "deepracer": _cars,
        "battlesnake": _snakes,
        "gymnasium": _gymnasium,
        "unity": _unity,
    }
    if kind not in makers:
        raise SettingError(f"There is no kind of world '{kind}'. {nearest(kind, KINDS)}")
    return makers[kind](**words)


def _cars(track: Any = "reinvent_base", actions: Any = None, **words: Any) -> World:
    import math

    from racecraft.worlds.deepracer.env.actions import ActionTable
    from racecraft.worlds.deepracer.env.world import RaceWorld
    from racecraft.worlds.deepracer.files.model_metadata import default_model_metadata
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    if actions is None:
        pairs = [(one.steering_rad, one.speed_mps) for one in default_model_metadata().actions]
        actions = ActionTable.of(pairs)
    elif not hasattr(actions, "spec"):
        actions = ActionTable.of([(math.radians(degrees), speed) for degrees, speed in actions])
    return RaceWorld(load_track(track) if isinstance(track, str) else track, actions, **words)


def _snakes(**words: Any) -> World:
    import dataclasses

    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld, WorldSettings

    of_game = {field.name for field in dataclasses.fields(GameSettings)}
    game = GameSettings(**{name: value for name, value in words.items() if name in of_game})
    return BattlesnakeWorld(
        WorldSettings(game, **{name: value for name, value in words.items() if name not in of_game})
    )


def _gymnasium(environment: Any, num_worlds: int = 1, **words: Any) -> World:
    from racecraft.worlds.gymnasium.env.from_gymnasium import GymnasiumWorld

    return GymnasiumWorld(environment, num_worlds, **words)


def _unity(build: str, **words: Any) -> World:
    from racecraft.worlds.unity.env.world import UnityWorld

    return UnityWorld(build, **words)
