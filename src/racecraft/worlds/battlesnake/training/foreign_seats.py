"""Seats of foreign snakes in games of self-play: servers behind addresses, runs, files, whatever an arena may seat.

They are asked as the official engine asks: `/start`, a move a turn, all at once, `/end`. Who gives no move in time
moves as the official rule says (`evaluation/seats.py`).
"""

from __future__ import annotations

from collections.abc import Mapping

from racecraft.contract.world import Array
from racecraft.worlds.battlesnake.env.board import MOVES, Board
from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld
from racecraft.worlds.battlesnake.evaluation.seats import Seat, take_seat
from racecraft.worlds.battlesnake.players.messages import GameCard, message
from racecraft.worlds.battlesnake.players.protocol import PlayerError

SILENT_MOVES = 50
"""Moves without an answer, one after the other, after which nothing can be learned from a snake."""


class ForeignSeats:
    """Foreign snakes at some seats of N games.

    Args:
        names: Who sits where: what `take_seat` knows, by (game, seat).
        world: The games.
        timeout_ms: Time for an answer.

    Raises:
        PlayerError: There is no such player, or a server does not answer `GET /`.
    """

    def __init__(self, names: Mapping[tuple[int, int], str], world: BattlesnakeWorld, timeout_ms: int) -> None:
        self._world, self._timeout_ms = world, timeout_ms
        self._seats: dict[tuple[int, int], Seat] = {}
        self._games: dict[int, tuple[GameCard, Board]] = {}
        self._silent: dict[tuple[int, int], int] = dict.fromkeys(names, 0)
        self._begun = 0
        try:
            for place, name in names.items():
                self._seats[place] = take_seat(name, seed=len(self._seats))
        except BaseException:
            self.close()
            raise

    def choose(self, moves: Array) -> None:
        """Write the moves of all foreign snakes that are alive into `moves` int64 (N, M).

        Raises:
            PlayerError: A snake has not answered for so long that nothing can be learned from it.
        """
        seconds, settings = self._timeout_ms / 1000, self._world.game_settings
        requests = []
        for game in sorted({game for game, _ in self._seats}):
            board = self._world.board(game)
            card = self._card_of(game, board)
            for (here, number), seat in self._seats.items():
                if here == game and board.snakes[number].alive:
                    seat.prefetch(message(board, settings, f"s{number}", card), seconds)
                    requests.append((game, number, board))
        for game, number, board in requests:
            seat = self._seats[game, number]
            failed = seat.failures.timeouts + seat.failures.crashes
            moves[game, number] = MOVES.index(seat.answer(board, settings, f"s{number}", seconds))
            self._note((game, number), seat, seat.failures.timeouts + seat.failures.crashes > failed)

    def close(self) -> None:
        """Tell servers that their games are over, and let go of connections, processes and threads."""
        for game in list(self._games):
            self._notify_seats("end", game)
        for seat in self._seats.values():
            seat.leave()

    def _card_of(self, game: int, board: Board) -> GameCard:
        """Return what servers are told of a game; where another has begun they hear of the end and of the start."""
        known = self._games.get(game)
        if known is not None and board.turn > known[1].turn:
            self._games[game] = known[0], board
            return known[0]
        if known is not None:
            self._notify_seats("end", game)
        self._begun += 1
        seated = {f"s{number}": seat for (here, number), seat in self._seats.items() if here == game}
        names = {snake.id: seated[snake.id].name if snake.id in seated else "racecraft" for snake in board.snakes}
        looks = {snake.id: seated[snake.id].appearance if snake.id in seated else {} for snake in board.snakes}
        card = GameCard(f"training-{self._begun}", self._timeout_ms, names, looks)
        self._games[game] = card, board
        for seat in seated.values():
            seat.reset_seat()
        self._notify_seats("start", game)
        return card

    def _notify_seats(self, what: str, game: int) -> None:
        card, board = self._games[game]
        for (here, number), seat in self._seats.items():
            if here == game:
                request = message(board, self._world.game_settings, f"s{number}", card)
                seat.notify(what, request, self._timeout_ms / 1000)

    def _note(self, place: tuple[int, int], seat: Seat, is_silent: bool) -> None:
        self._silent[place] = self._silent[place] + 1 if is_silent else 0
        if self._silent[place] >= SILENT_MOVES:
            raise PlayerError(
                "{name} gave none of the last {silent_moves} moves ({last_error}); expected a "
                "snake that answers. Start it again, or give it more time with --set selfplay.foreign_ms.",
                name=seat.name,
                silent_moves=SILENT_MOVES,
                last_error=seat.failures.last_error,
            )
