"""Everyone against everyone: every group of players meets with the same dice at every rotation of its seats.

Rounds come one after another, so that a tournament that is broken off has let everyone meet about as often, and one
with more rounds begins with the games of one with fewer.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

from racecraft.contract.random_streams import stream_keys
from racecraft.worlds.battlesnake.env.board import BoardError
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.match import Played, play
from racecraft.worlds.battlesnake.evaluation.seats import Seat
from racecraft.worlds.battlesnake.evaluation.standings import GameResult, Table, table_of

MAX_TURNS = 1000
"""A game that lasts longer is a draw of all who live."""


class Tournament:
    """A round robin, game by game; it may be left at any time and stands as it is.

    Args:
        seats: Who takes part; names differ.
        settings: What is played; `players` snakes sit at a board, so groups have that size.
        rounds: How many dice each group meets with; it plays `players` games with each, one a rotation of seats.
        timeout_ms: Time for an answer.
        seed: Chance of all games.
        most_turns: A longer game is a draw of all who live.
        played: Games that were played already, in order; they are not played again.

    Raises:
        BoardError: Fewer players than a board seats, or two of the same name.
    """

    def __init__(
        self,
        seats: Sequence[Seat],
        settings: GameSettings,
        rounds: int = 1,
        timeout_ms: int = 500,
        seed: int = 0,
        most_turns: int = MAX_TURNS,
        played: Iterable[GameResult] = (),
    ) -> None:
        self.names = [seat.name for seat in seats]
        _check(self.names, settings.players)
        self._seats, self._settings = seats, settings
        self._timeout_ms, self._most_turns = timeout_ms, most_turns
        self._meetings = _meetings(len(seats), settings.players, rounds, seed)
        self.games = list(played)[: len(self._meetings)]

    @property
    def planned(self) -> int:
        """How many games it has."""
        return len(self._meetings)

    def play(self) -> Iterator[tuple[GameResult, Played]]:
        """Play what is left, one game at a time."""
        for number in range(len(self.games) + 1, len(self._meetings) + 1):
            group, key = self._meetings[number - 1]
            seats = [self._seats[one] for one in group]
            before = [(seat.failures.timeouts, seat.failures.crashes) for seat in seats]
            played = play(
                replace(self._settings), seats, StreamDice(key), f"game-{number}", self._timeout_ms,
                most_turns=self._most_turns,
            )  # fmt: skip
            late = tuple(seat.failures.timeouts - was for seat, (was, _) in zip(seats, before, strict=True))
            failed = tuple(seat.failures.crashes - was for seat, (_, was) in zip(seats, before, strict=True))
            game = GameResult(number, group, tuple(played.places()), played.turns, late, failed)
            self.games.append(game)
            yield game, played

    def table(self) -> Table:
        """Return what came of it so far."""
        return table_of(self.names, self.games, self.planned)


def tournament(
    seats: Sequence[Seat],
    settings: GameSettings,
    rounds: int = 1,
    timeout_ms: int = 500,
    seed: int = 0,
    most_turns: int = MAX_TURNS,
    on_game: Callable[[Played, int, int], None] | None = None,
) -> Table:
    """Play a round robin to its end; arguments as for `Tournament`.

    `on_game` is called after each game with it, its number from 1, and how many there are.
    """
    held = Tournament(seats, settings, rounds, timeout_ms, seed, most_turns)
    for game, played in held.play():
        if on_game is not None:
            on_game(played, game.number, held.planned)
    return held.table()


def _check(names: Sequence[str], at_a_board: int) -> None:
    if len(set(names)) < len(names):
        raise BoardError("players {names}; expected every name once.", names=", ".join(names))
    if at_a_board < 2:
        raise BoardError("{at_a_board} snake a game; a tournament needs at least 2.", at_a_board=at_a_board)
    if len(names) < at_a_board:
        few = f"only {len(names)} player" + "s" * (len(names) != 1)
        raise BoardError(
            "{at_a_board} snakes a game, but {few}; name at least {at_a_board}.", at_a_board=at_a_board, few=few
        )


def _meetings(players: int, at_a_board: int, rounds: int, seed: int) -> list[tuple[tuple[int, ...], int]]:
    """Return who meets, in which order of seats, and the key of the dice."""
    groups = list(itertools.combinations(range(players), at_a_board))
    keys = stream_keys(seed, "snake tournament", len(groups) * rounds)
    return [
        (group[turn:] + group[:turn], int(keys[one * len(groups) + number]))
        for one in range(rounds)
        for number, group in enumerate(groups)
        for turn in range(at_a_board)
    ]
