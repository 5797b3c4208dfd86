"""An arena to look at in a browser, while it plays and after.

    GET /                                    the page (`analysis/arena_page.html`)
    GET /api/board                           terms, ratings, who met whom, whether it plays
    GET /api/games?before=120&player=Flo     30 games before number 120, the latest first; of one player, or of all
                   &snakes=2                 of so many snakes, or 0: of all
    GET /game?number=17                      one game on its own page, to step and play

Everything comes from the arena's file: it may be played in by another process. Only this machine is served.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from racecraft.contract.errors import UserInputError
from racecraft.serving.http_service import HttpError, HttpService, Reply, Request
from racecraft.serving.service_thread import ServiceThread
from racecraft.web.ports import LOOPBACK
from racecraft.worlds.battlesnake.analysis.arena_page import arena_page
from racecraft.worlds.battlesnake.analysis.board_frames import frame, game_end, game_facts, title_of
from racecraft.worlds.battlesnake.analysis.board_page import board_page
from racecraft.worlds.battlesnake.evaluation.record import played_in
from racecraft.worlds.battlesnake.league import board
from racecraft.worlds.battlesnake.league.ladder import Ladder
from racecraft.worlds.battlesnake.league.store import ArenaStore

FRESH = (("Cache-Control", "no-store"),)
NO_END = 1 << 62


class ArenaServer:
    """Serves one arena on this machine, in a thread of its own.

    Args:
        store: The arena.
    """

    def __init__(self, store: ArenaStore) -> None:
        self._store, self._ladder = store, Ladder(store.terms.snakes)
        self._page = arena_page(store.path.name).encode()
        self._thread = ServiceThread(HttpService(self._answer), "racecraft-arena")

    def start(self, port: int = 0) -> str:
        """Begin to serve; return the address.

        Raises:
            PortError: The port cannot be listened on.
        """
        return f"http://{LOOPBACK}:{self._thread.start(LOOPBACK, port)}/"

    def close(self) -> None:
        """Stop; closing twice is closing once."""
        self._thread.close()

    async def _answer(self, request: Request) -> Reply:
        if request.method != "GET":
            raise HttpError(405, "wrong_method", "an arena can only be looked at here: GET.")
        told = {"/": self._own_page, "/api/board": self._board, "/api/games": self._games, "/game": self._game}
        if request.path not in told:
            raise HttpError(404, "no_such_page", f"there is no {request.path[:80]} in an arena; begin at /.")
        try:
            return told[request.path](request)
        except UserInputError as error:
            raise HttpError(404, "not_there", str(error)) from error

    def _own_page(self, request: Request) -> Reply:
        return Reply(self._page, "text/html; charset=utf-8", FRESH)

    def _board(self, request: Request) -> Reply:
        return _as_json(board.board_facts(self._store, self._ladder))

    def _games(self, request: Request) -> Reply:
        before, snakes = _whole(request, "before", NO_END), _whole(request, "snakes", 0)
        names = [one.name for one in self._store.entrants()]
        player = self._store.find(request.query["player"]).number if request.query.get("player") else None
        games = [
            game
            for game in self._store.games()
            if game.number < before and snakes in (0, len(game.players)) and (player is None or player in game.players)
        ]
        latest = games[: -board.GAMES_AT_A_TIME - 1 : -1]
        return _as_json({"games": [board.game_facts(game, names) for game in latest], "more": len(games) > len(latest)})

    def _game(self, request: Request) -> Reply:
        number = _whole(request, "number")
        played = played_in(self._store.record(number).splitlines(), Path(f"game {number}"))
        card = played.card
        events = [*(frame(one, card) for one in played.boards), game_end(played.settings, card)]
        page = board_page(title_of(card), game_facts(played.settings, card, "complete"), events)
        return Reply(page.encode(), "text/html; charset=utf-8", FRESH)


def _as_json(value: dict[str, Any]) -> Reply:
    return Reply(json.dumps(value, separators=(",", ":"), allow_nan=False).encode(), headers=FRESH)


def _whole(request: Request, name: str, usual: int | None = None) -> int:
    """Return a whole number of the address, or raise an `HttpError` (bad_number)."""
    text = request.query.get(name, "" if usual is None else str(usual))
    if not text.isascii() or not text.isdigit() or len(text) > 20:
        raise HttpError(400, "bad_number", f"{name} is {text[:40]!r}; expected a whole number, 0 or more.")
    return int(text)
