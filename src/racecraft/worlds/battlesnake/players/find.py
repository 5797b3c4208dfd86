"""Finds a snake player by what the user wrote: a name, a FILE.py, a RUN, `search:` a RUN, or `search+` one of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from racecraft.contract.errors import nearest
from racecraft.contract.extensions import load_offered, offered
from racecraft.contract.random_streams import stream_keys
from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.flood_fill import FloodFill
from racecraft.worlds.battlesnake.players.from_file import MEMORY_MB, load_file_player
from racecraft.worlds.battlesnake.players.hungry import Hungry
from racecraft.worlds.battlesnake.players.json_adapter import JsonAdapter
from racecraft.worlds.battlesnake.players.protocol import JsonPlayer, PlayerError, SnakePlayer
from racecraft.worlds.battlesnake.players.random_safe import RandomSafe
from racecraft.worlds.battlesnake.players.weights import read_weights

PLAYERS = {
    "random_safe": "any move that is not surely fatal",
    "hungry": "straight to the nearest food",
    "flood_fill": "keeps room behind it, avoids stronger heads, eats when it must",
    "area_control": "wants more squares than the others, whatever they reply",
    "search": "looks many moves ahead (alpha-beta in duels, PUCT among more), as long as it is given time",
}
"""The built-in players by name, weakest first, with what they do."""
WEIGHED = "search:"
"""Before a FILE.json of weights: search that appraises positions by them."""


def find_player(
    name: str, seed: int = 0, memory_mb: int = MEMORY_MB, is_isolated: bool = False
) -> SnakePlayer | JsonPlayer:
    """Return a player: a name of `PLAYERS`, a FILE.py, a trained snake's RUN, or `search+` one of them.

    A name of `racecraft.players` is that of an installed package.

    RUN is the folder of a training by itself (its best checkpoint) or with `:best`, `:last` or `:N` behind it. Search
    on top of a trained snake weighs every move as its policy does; on top of others it looks at their move first.
    `search:RUN` asks the trained snake about every position that it comes to: its policy where to look, its critic what
    it is worth.

    `search:FILE.json` is search by the weights that `snakes tune` found.

    Args:
        name: What the user wrote.
        seed: Chance of the players that roll dice.
        memory_mb: Memory that a FILE.py may use.
        is_isolated: A FILE.py can compute and nothing else.

    Raises:
        PlayerError: There is no such player, or the file or run cannot be used.
        CheckpointError: No such checkpoint, or a damaged one.
        InputFileError: No weights.
    """
    if name.startswith("search+") and not Path(name).is_file():
        from racecraft.worlds.battlesnake.players.search import Search

        guide = find_player(name.removeprefix("search+"), seed, memory_mb, is_isolated)
        return Search(guide=guide if isinstance(guide, SnakePlayer) else JsonAdapter(guide))
    if name.startswith(WEIGHED) and name.endswith(".json"):
        from racecraft.worlds.battlesnake.players.search import Search

        return Search(weights=read_weights(name.removeprefix(WEIGHED)))
    if name.startswith("search:") and not Path(name).is_file():
        from racecraft.worlds.battlesnake.players.search import Search
        from racecraft.worlds.battlesnake.players.trained import load_network

        return Search(network=load_network(name.removeprefix("search:")))
    if name.endswith(".py") or Path(name).is_file():
        return load_file_player(name, memory_mb, is_isolated)
    if name not in PLAYERS and (make := load_offered("players", name)) is not None:
        made: SnakePlayer | JsonPlayer = make(seed)
        return made
    if name not in PLAYERS and _may_be_run(name):
        from racecraft.worlds.battlesnake.players.trained import load_trained_snake

        return load_trained_snake(name)
    if "/" in name and "://" not in name:
        raise PlayerError("{name}: no such file or folder; expected a FILE.py or the RUN of a training.", name=name)
    if name not in PLAYERS:
        hint = nearest(name, [*PLAYERS, *offered("players")])
        raise PlayerError(
            "There is no player '{name}'. {hint} A FILE.py or the RUN of a training will do, too.", name=name, hint=hint
        )
    return _built_in(name, seed)


def warm_up(player: SnakePlayer | JsonPlayer) -> None:
    """Let a built-in player choose once on a small board, so that compiling does not cost it its first moves."""
    if not isinstance(player, SnakePlayer):
        return
    snakes = [Snake("a", [(1, 1)] * 3), Snake("b", [(5, 5)] * 3)]
    board, settings = Board(7, 7, snakes=snakes, food=[(3, 3)]), GameSettings(7, 7, 2)
    player.choose(board, settings, "a", 0.0)
    prepare: Callable[[Board, GameSettings, str], None] | None = getattr(player, "warm_up", None)
    if prepare is not None:
        prepare(board, settings, "a")


def _may_be_run(name: str) -> bool:
    """Tell whether a name leads to a folder; what follows its last colon may say which checkpoint."""
    return Path(name).is_dir() or Path(name.rpartition(":")[0] or ".absent").is_dir()


def _built_in(name: str, seed: int) -> SnakePlayer:
    if name == "random_safe":
        return RandomSafe(int(stream_keys(seed, "snake player", 1)[0]))
    if name == "hungry":
        return Hungry()
    if name == "flood_fill":
        return FloodFill()
    from racecraft.worlds.battlesnake.players.area_control import (
        AreaControl,  # compiled: it waits until somebody wants it
    )
    from racecraft.worlds.battlesnake.players.search import Search

    return AreaControl() if name == "area_control" else Search()
