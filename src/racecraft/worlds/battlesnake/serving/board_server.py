"""A game to watch in a browser while it is played, or after: our own page, and the official board's protocol.

    GET /                        our page (`pages/board.html`)
    GET /games/{id}              what the official board asks first
    ws  /games/{id}/events       every position so far, then each as it comes, then the end (facts: A.11)

The official board is a page from elsewhere that asks a server on this machine, so these answers allow every origin,
under this machine's own names; there is nothing in them but the game. It runs in a thread of its own: the game is
played in the caller's.
"""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from racecraft.web.access import Access
from racecraft.web.answers import json_answer, page_answer
from racecraft.web.application import make_application
from racecraft.web.server import ServerThread
from racecraft.worlds.battlesnake.analysis.board_frames import Event
from racecraft.worlds.battlesnake.analysis.board_page import BOARD, board_data

FROM_EVERYWHERE = {
    "Access-Control-Allow-Origin": "*",
    "Access-Control-Allow-Methods": "GET",
    "Access-Control-Allow-Private-Network": "true",
    "Cross-Origin-Resource-Policy": "cross-origin",
}


class BoardServer:
    """Serves one game on this machine.

    Args:
        title: Headline of our page.
        game: `board_frames.game_facts`.
        events: What is known of the game already.
        speed: Turns a second at which our page begins to play.
    """

    def __init__(self, title: str, game: dict[str, Any], events: Sequence[Event] = (), speed: float = 8) -> None:
        self._game = game
        self._texts = [json.dumps(event, separators=(",", ":")) for event in events]
        self._over = any(event["Type"] == "game_end" for event in events)
        way = f"/games/{game['ID']}"
        self._page = board_data(title, game, live=f"{way}/events", speed=speed)
        self._viewers: dict[asyncio.Event, asyncio.AbstractEventLoop] = {}
        """What wakes each viewer, and in which loop."""
        routes = [
            Route("/", self._own_page),
            Route(way, self._facts, methods=["GET", "OPTIONS"]),
            WebSocketRoute(f"{way}/events", self._send_events),
        ]
        self._thread = ServerThread(make_application(routes, Access(pages=False)), "racecraft-board")
        self._seen_to_the_end = threading.Event()

    @property
    def viewers(self) -> int:
        """How many watch."""
        return len(self._viewers)

    def start(self, port: int = 0, host: str = "127.0.0.1") -> str:
        """Begin to serve; return the address.

        Raises:
            PortError: The port cannot be listened on.
        """
        return f"http://{host}:{self._thread.start(host, port)}"

    def add(self, event: Event) -> None:
        """Send an event to everyone who watches now or later; from any thread."""
        self._texts.append(json.dumps(event, separators=(",", ":")))
        self._over = self._over or event["Type"] == "game_end"
        for wake, loop in list(self._viewers.items()):
            with suppress(RuntimeError):  # the server has ended
                loop.call_soon_threadsafe(wake.set)

    def wait_for_viewer(self, seconds: float | None = None) -> bool:
        """Wait until somebody was sent the game to its end; tell whether that happened in time."""
        return self._seen_to_the_end.wait(seconds)

    def close(self) -> None:
        """Stop; closing twice is closing once."""
        self._thread.close()

    async def _own_page(self, request: Request) -> Response:
        return page_answer(request, BOARD, **self._page)

    async def _facts(self, request: Request) -> Response:
        status = "complete" if self._over else "running"
        return json_answer({"Game": self._game | {"Status": status}}, headers=FROM_EVERYWHERE)

    async def _send_events(self, socket: WebSocket) -> None:
        """Tell a viewer everything, until it or the game is gone."""
        await socket.accept()
        wake = asyncio.Event()
        self._viewers[wake] = asyncio.get_running_loop()
        listening = asyncio.ensure_future(_listen(socket))
        listening.add_done_callback(lambda _: wake.set())
        try:
            sent = 0
            while not listening.done():
                wake.clear()
                while sent < len(self._texts):
                    await socket.send_text(self._texts[sent])
                    sent += 1
                if self._over and sent == len(self._texts):
                    await socket.close()
                    self._seen_to_the_end.set()
                    return
                await wake.wait()
        except WebSocketDisconnect:
            pass
        finally:
            del self._viewers[wake]
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)


async def _listen(socket: WebSocket) -> None:
    """Wait until a viewer leaves; it has nothing to say."""
    while (await socket.receive())["type"] != "websocket.disconnect":
        pass
