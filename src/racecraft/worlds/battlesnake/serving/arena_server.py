"""An arena to look at in a browser, while it plays and after.

    GET /                                    the page (`pages/arena.html`)
    GET /api/board                           terms, ratings, who met whom, whether it plays
    GET /api/games?before=120&player=Flo     30 games before number 120, the latest first; of one player, or of all
                   &snakes=2                 of so many snakes, or 0: of all
    GET /game?number=17                      one game on its own page, to step and play

Everything comes from the arena's file: another process may play in it. Only this machine is served.
"""

from __future__ import annotations

import threading
from pathlib import Path

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from racecraft.contract.errors import UserInputError
from racecraft.web.answers import json_answer, page_answer
from racecraft.web.application import make_application
from racecraft.web.errors import WebError
from racecraft.web.ports import LOOPBACK
from racecraft.web.query import whole_number
from racecraft.web.server import ServerThread
from racecraft.worlds.battlesnake.analysis.board_frames import frame, game_end, game_facts, title_of
from racecraft.worlds.battlesnake.analysis.board_page import ARENA, BOARD, board_data
from racecraft.worlds.battlesnake.evaluation.record import played_in
from racecraft.worlds.battlesnake.league import board
from racecraft.worlds.battlesnake.league.ladder import Ladder
from racecraft.worlds.battlesnake.league.store import ArenaStore

NO_END = 1 << 62


class ArenaServer:
    """Serves one arena on this machine, in a thread of its own.

    Args:
        store: The arena.
    """

    def __init__(self, store: ArenaStore) -> None:
        self._store, self._ladder = store, Ladder(store.terms.snakes)
        self._lock = threading.Lock()
        """Of the ladder, which learns from new games as it is asked."""
        self._name = store.path.name
        routes = [
            Route("/", self._own_page),
            Route("/api/board", self._board),
            Route("/api/games", self._games),
            Route("/game", self._game),
        ]
        self._thread = ServerThread(make_application(routes), "racecraft-arena")

    def start(self, port: int = 0) -> str:
        """Begin to serve; return the address.

        Raises:
            PortError: The port cannot be listened on.
        """
        return f"http://{LOOPBACK}:{self._thread.start(LOOPBACK, port)}/"

    def close(self) -> None:
        """Stop; closing twice is closing once."""
        self._thread.close()

    def _own_page(self, request: Request) -> Response:
        return page_answer(request, ARENA, title=self._name)

    def _board(self, request: Request) -> Response:
        with self._lock:
            return json_answer(board.board_facts(self._store, self._ladder))

    def _games(self, request: Request) -> Response:
        before, snakes = whole_number(request, "before", NO_END), whole_number(request, "snakes", 0)
        player = self._number_of(request.query_params.get("player", ""))
        names = [one.name for one in self._store.entrants()]
        games = [
            game
            for game in self._store.games()
            if game.number < before and snakes in (0, len(game.players)) and (player is None or player in game.players)
        ]
        latest = games[: -board.GAMES_AT_A_TIME - 1 : -1]
        return json_answer(
            {"games": [board.game_facts(game, names) for game in latest], "more": len(games) > len(latest)}
        )

    def _game(self, request: Request) -> Response:
        number = whole_number(request, "number")
        try:
            record = self._store.record(number)
        except UserInputError as error:
            raise WebError(404, "not_there", str(error)) from error
        played = played_in(record.splitlines(), Path(f"game {number}"))
        card = played.card
        events = [*(frame(one, card) for one in played.boards), game_end(played.settings, card)]
        facts = game_facts(played.settings, card, "complete")
        return page_answer(request, BOARD, **board_data(title_of(card), facts, events))

    def _number_of(self, player: str) -> int | None:
        try:
            return self._store.find(player).number if player else None
        except UserInputError as error:
            raise WebError(404, "not_there", str(error)) from error
