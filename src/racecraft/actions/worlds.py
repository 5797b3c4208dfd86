"""A world to step by hand: arrays in, arrays out, as `racecraft.contract.world` promises."""

from __future__ import annotations

from typing import Any

from racecraft.contract.errors import SettingError
from racecraft.contract.kinds import find_kind
from racecraft.contract.world import World


def make_world(kind: str, **words: Any) -> World:
    """Return a world of a kind.

    Args:
        kind: "deepracer" (`track`, `actions` in degrees and m/s, `reward`, `num_cars`, and `RaceWorld`'s own words),
            "battlesnake" (`BattlesnakeWorld`'s `WorldSettings`, and `width`, `height`, `players`, `ruleset`, `map` of
            the game), "gymnasium" (`environment`, `num_worlds`), "unity" (`build`, and `UnityWorld`'s own words), or
            the name of another world that is installed.
        words: What that kind of world is made of.

    Raises:
        MissingWorldError: There is no such kind.
        SettingError: Its worlds are made by a training only.
        UserInputError: Something given cannot be used.
    """
    make = find_kind(kind).piece("make_world")
    if make is None:
        raise SettingError(
            "the kind of world {kind!r} names no make_world; expected one. Only trainings make its worlds.", kind=kind
        )
    world: World = make(**words)
    return world
