"""A user's FILE.py as a player of boards, so that search can lean on what it would do."""

from __future__ import annotations

from racecraft.worlds.battlesnake.env.board import Board
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.messages import GameCard, message
from racecraft.worlds.battlesnake.players.protocol import JsonPlayer


class JsonAdapter:
    """Writes a board down as the official JSON and asks for a move. The file hears of no start and no end.

    Args:
        player: Who is asked.
    """

    def __init__(self, player: JsonPlayer) -> None:
        self._player = player

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return the move of whoever is asked.

        Raises:
            PlayerError: It raised, died, or returned no move.
            TimeoutError: It has not answered within `seconds`.
        """
        card = GameCard("search", timeout_ms=max(1, round(1000 * seconds)))
        return self._player.move(message(board, settings, snake_id, card), seconds)
