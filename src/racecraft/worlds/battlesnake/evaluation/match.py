"""One game between seats, from set-up to its winner, by the true rules and with the official etiquette.

Servers hear `/start`, are asked together on every turn, and hear `/end`; players of ours think one after another, each
with the time to itself. Whoever gives no move in time moves as the official rule says (`seats.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from racecraft.worlds.battlesnake.env.board import Board, BoardError
from racecraft.worlds.battlesnake.env.dice import Dice
from racecraft.worlds.battlesnake.env.reference import Referee
from racecraft.worlds.battlesnake.env.rulesets import is_over
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.seats import Seat
from racecraft.worlds.battlesnake.players.messages import GameCard, message


@dataclass
class Played:
    """A game that was played."""

    settings: GameSettings
    card: GameCard
    boards: list[Board] = field(default_factory=list)
    """Every position, from turn 0 to the last."""
    over: bool = True
    """False where it was stopped before its end."""
    moves: list[dict[str, str]] = field(default_factory=list)
    """Of every turn that was played, by the ids of those who lived; empty where nobody kept them."""

    @property
    def turns(self) -> int:
        """The last position's turn."""
        return self.boards[-1].turn

    @property
    def winner(self) -> str:
        """Id of the only snake alive at the end; "" where there is none, or more than one."""
        alive = self.boards[-1].alive()
        return alive[0].id if len(alive) == 1 and not self.is_solo else ""

    @property
    def is_solo(self) -> bool:
        """Whether it goes on with one snake alive, so that nobody wins it."""
        first = self.boards[0]
        return not is_over(Board(first.width, first.height, snakes=first.snakes[:1]), self.settings)

    def places(self) -> list[int]:
        """Return each seat's place, 0 the best; who left on the same turn shares a place."""
        lasted = [snake.on or math.inf for snake in self.boards[-1].snakes]
        return [sum(other > own for other in lasted) for own in lasted]


def play(
    settings: GameSettings,
    seats: Sequence[Seat],
    dice: Dice,
    game_id: str = "game",
    timeout_ms: int = 500,
    sequential: bool = False,
    most_turns: int | None = None,
    watch: Callable[[Board, GameCard], None] | None = None,
    until: Callable[[Board], bool] | None = None,
) -> Played:
    """Play a game; seat n is snake `s{n}`.

    Args:
        settings: What is played; as many players as seats.
        seats: Who plays.
        dice: All chance of the game.
        game_id: What servers are told.
        timeout_ms: Time for an answer.
        sequential: Ask servers one after another.
        most_turns: Stop there.
        watch: Called with every position.
        until: Stop at the first position of which this is true.

    Raises:
        BoardError: Seats and players differ in number, or the settings cannot be played.
    """
    if settings.players != len(seats):
        raise BoardError(
            "{count} seats for {players} snakes; expected as many.", count=len(seats), players=settings.players
        )
    referee = Referee(settings, dice)
    by_id = {f"s{number}": seat for number, seat in enumerate(seats)}
    played = Played(settings, _card(by_id, game_id, timeout_ms))
    for seat in seats:
        seat.reset_seat()
    _keep(played, referee.board, watch)
    _tell(by_id, "start", referee.board, played, timeout_ms / 1000)
    while not referee.over and (most_turns is None or referee.board.turn < most_turns):
        moves = _ask(by_id, referee.board, played, timeout_ms / 1000, sequential)
        referee.turn(moves)
        played.moves.append(moves)
        _keep(played, referee.board, watch)
        if until is not None and until(referee.board):
            break
    played.over = referee.over
    _tell(by_id, "end", referee.board, played, timeout_ms / 1000)
    return played


def _card(by_id: dict[str, Seat], game_id: str, timeout_ms: int) -> GameCard:
    names = {one: seat.name for one, seat in by_id.items()}
    looks = {one: seat.appearance for one, seat in by_id.items()}
    return GameCard(game_id, timeout_ms, names, looks)


def _ask(by_id: dict[str, Seat], board: Board, played: Played, seconds: float, sequential: bool) -> dict[str, str]:
    living = [snake.id for snake in board.alive()]
    moves = {}
    if not sequential:
        for one in living:
            by_id[one].prefetch(message(board, played.settings, one, played.card), seconds)
    for one in living:
        if sequential:
            by_id[one].prefetch(message(board, played.settings, one, played.card), seconds)
        moves[one] = by_id[one].answer(board, played.settings, one, seconds)
    for one in living:
        played.card.latencies_ms[one] = by_id[one].latency_ms
    return moves


def _tell(by_id: dict[str, Seat], what: str, board: Board, played: Played, seconds: float) -> None:
    for one, seat in by_id.items():
        seat.notify(what, message(board, played.settings, one, played.card), seconds)


def _keep(played: Played, board: Board, watch: Callable[[Board, GameCard], None] | None) -> None:
    played.boards.append(board)
    if watch is not None:
        watch(board, played.card)
