"""What a snake player is, and how one is found by name.

A player is asked for one move at a time and is told everything it may know: the board, the settings of the game, who it
is and how long it may think. It may keep nothing from move to move, and may be asked about many games at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol, runtime_checkable

from racecraft.contract.errors import UserInputError, nearest
from racecraft.contract.world import Array
from racecraft.envs.battlesnake.board import Board, Snake
from racecraft.envs.battlesnake.settings import GameSettings

Message = dict[str, Any]
"""The JSON object of the official API (facts: A.10); see `messages.py`."""


class PlayerError(UserInputError):
    """A player cannot be found, cannot be loaded, or failed to give a move."""


class LatePlayerError(PlayerError, TimeoutError):
    """A player did not answer in time."""


@runtime_checkable
class SnakePlayer(Protocol):
    """Whoever looks at a board."""

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return one of `board.MOVES`.

        Args:
            board: The position; eliminated snakes may be left out. The player does not change it.
            settings: What the game is played with.
            snake_id: Who the player is on this board; alive.
            seconds: Time to think. A player that knows its answer gives it at once.

        Raises:
            PlayerError: It has no move; the arena and the server then move for it.
        """
        ...


class Question(NamedTuple):
    """What one snake is asked: the first three arguments of `SnakePlayer.choose` in the order of a tuple."""

    board: Board
    snake_id: str
    """Who the player is on this board; alive."""
    settings: GameSettings


@runtime_checkable
class ManyPlayer(SnakePlayer, Protocol):
    """Whoever looks at many boards as cheaply as at one: a network with one forward pass for all of them.

    The server gathers the questions that wait at a moment and asks them together.
    """

    def choose_many(self, questions: Sequence[Question]) -> list[str]:
        """Return one of `board.MOVES` for every question, in their order.

        The boards may differ in everything: size, ruleset, number of snakes. Called by one thread at a time, with at
        least one question; what `choose` would answer is answered here too.

        Raises:
            PlayerError: It has no moves; the server then moves for all of these snakes.
        """
        ...


@runtime_checkable
class Weigher(Protocol):
    """Whoever can say of every snake on a board how likely it would choose each move: a guide for search."""

    def weigh(self, board: Board, settings: GameSettings) -> Array:
        """Return for every living snake, in their order, the chances of its moves, float (M, 4), each row summing to 1.

        Moves are in the order of `board.MOVES`.
        """
        ...


@runtime_checkable
class LetterPlayer(Protocol):
    """Whoever is asked by letter: the official JSON instead of a board."""

    def start(self, message: Message, seconds: float) -> None:
        """Be told that a game begins."""
        ...

    def move(self, message: Message, seconds: float) -> str:
        """Return one of `board.MOVES`, or raise a `PlayerError`."""
        ...

    def end(self, message: Message, seconds: float) -> None:
        """Be told that a game is over."""
        ...

    def close(self) -> None:
        """Let go of what it holds: a connection, a process. It is not asked again."""
        ...


PLAYERS = {
    "random_safe": "any move that is not surely fatal",
    "hungry": "straight to the nearest food",
    "flood_fill": "keeps room behind it, avoids stronger heads, eats when it must",
    "area_control": "wants more squares than the others, whatever they reply",
    "search": "looks many moves ahead (decoupled PUCT), as long as it is given time",
}
"""The built-in players by name, weakest first, with what they do."""


def find_player(name: str, seed: int = 0) -> SnakePlayer | LetterPlayer:
    """Return a player: a name of `PLAYERS`, a FILE.py, a trained snake's RUN, or `search+` one of them.

    RUN is the folder of a training by itself (its best checkpoint) or with `:best`, `:last` or `:N` behind it. Search
    on top of a trained snake weighs every move as its policy does; on top of others it looks at their move first.

    Args:
        name: What the user wrote.
        seed: Chance of the players that roll dice.

    Raises:
        PlayerError: There is no such player, or the file or run cannot be used.
        CheckpointError: No such checkpoint, or a damaged one.
    """
    if name.startswith("search+") and not Path(name).is_file():
        from racecraft.players.battlesnake.by_letter import ByLetter
        from racecraft.players.battlesnake.search import Search

        guide = find_player(name.removeprefix("search+"), seed)
        return Search(guide=guide if isinstance(guide, SnakePlayer) else ByLetter(guide))
    if name.endswith(".py") or Path(name).is_file():
        from racecraft.players.battlesnake.from_file import load_file_player

        return load_file_player(name)
    if name not in PLAYERS and _may_be_run(name):
        from racecraft.players.battlesnake.trained import load_trained_snake

        return load_trained_snake(name)
    if "/" in name and "://" not in name:
        raise PlayerError(f"{name}: no such file or folder; expected a FILE.py or the RUN of a training.")
    if name not in PLAYERS:
        hint = nearest(name, PLAYERS)
        raise PlayerError(f"There is no player '{name}'. {hint} A FILE.py or the RUN of a training will do, too.")
    return _built_in(name, seed)


def warm_up(player: SnakePlayer | LetterPlayer) -> None:
    """Let a built-in player choose once on a small board, so that compiling does not cost it its first moves."""
    if isinstance(player, SnakePlayer):
        snakes = [Snake("a", [(1, 1)] * 3), Snake("b", [(5, 5)] * 3)]
        player.choose(Board(7, 7, snakes=snakes, food=[(3, 3)]), GameSettings(7, 7, 2), "a", 0.0)


def _may_be_run(name: str) -> bool:
    """Tell whether a name leads to a folder; what follows its last colon may say which checkpoint."""
    return Path(name).is_dir() or Path(name.rpartition(":")[0] or ".absent").is_dir()


def _built_in(name: str, seed: int) -> SnakePlayer:
    from racecraft.contract.random_streams import stream_keys
    from racecraft.players.battlesnake.area_control import AreaControl
    from racecraft.players.battlesnake.flood_fill import FloodFill
    from racecraft.players.battlesnake.hungry import Hungry
    from racecraft.players.battlesnake.random_safe import RandomSafe
    from racecraft.players.battlesnake.search import Search

    if name == "random_safe":
        return RandomSafe(int(stream_keys(seed, "snake player", 1)[0]))
    makers: dict[str, type] = {
        "hungry": Hungry,
        "flood_fill": FloodFill,
        "area_control": AreaControl,
        "search": Search,
    }
    player: SnakePlayer = makers[name]()
    return player
