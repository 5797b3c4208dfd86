"""A game to watch in a browser while it is played, or after: our own page, and the official board's protocol.

    GET /                        our page (`analysis/board_page.py`)
    GET /games/{id}              what the official board asks first
    ws  /games/{id}/events       every position so far, then each as it comes, then the end (facts: A.11)

The official board is a page from elsewhere that asks a server on this machine, so these answers allow every origin;
there is nothing in them but the game. It runs in a thread of its own: the game is played in the caller's.
"""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Sequence
from typing import Any

from racecraft.serving.http_service import HttpError, HttpService, Reply, Request, Upgrade
from racecraft.serving.service_thread import ServiceThread
from racecraft.serving.web_socket import WebSocket
from racecraft.worlds.battlesnake.analysis.board_frames import Event
from racecraft.worlds.battlesnake.analysis.board_page import board_page

FROM_EVERYWHERE = (
    ("Access-Control-Allow-Origin", "*"),
    ("Access-Control-Allow-Private-Network", "true"),
    ("Cache-Control", "no-store"),
)


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
        self._way = f"/games/{game['ID']}"
        self._page = board_page(title, game, live=f"{self._way}/events", speed=speed).encode()
        self._viewers: set[asyncio.Event] = set()
        self._thread = ServiceThread(HttpService(self._answer), "racecraft-board")
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
        text = json.dumps(event, separators=(",", ":"))
        self._thread.call(self._keep, text, event["Type"] == "game_end")

    def wait_for_viewer(self, seconds: float | None = None) -> bool:
        """Wait until somebody was sent the game to its end; tell whether that happened in time."""
        return self._seen_to_the_end.wait(seconds)

    def close(self) -> None:
        """Stop; closing twice is closing once."""
        self._thread.close()

    def _keep(self, text: str, over: bool) -> None:
        self._texts.append(text)
        self._over = self._over or over
        for wake in self._viewers:
            wake.set()

    async def _answer(self, request: Request) -> Reply | Upgrade:
        if request.method == "OPTIONS":
            return Reply(b"", headers=(*FROM_EVERYWHERE, ("Access-Control-Allow-Methods", "GET")))
        if request.method != "GET":
            raise HttpError(405, "wrong_method", "a game can only be watched: GET.")
        if request.path == "/":
            return Reply(self._page, "text/html; charset=utf-8", (("Cache-Control", "no-store"),))
        if request.path == self._way:
            status = "complete" if self._over else "running"
            return Reply(json.dumps({"Game": self._game | {"Status": status}}).encode(), headers=FROM_EVERYWHERE)
        if request.path == f"{self._way}/events":
            return Upgrade(self._tell)
        raise HttpError(
            404, "no_such_page", f"there is no {request.path[:80]}; there are /, {self._way} and its /events."
        )

    async def _tell(self, socket: WebSocket) -> None:
        """Tell a viewer everything, until it or the game is gone."""
        wake = asyncio.Event()
        self._viewers.add(wake)
        listening = asyncio.ensure_future(_listen(socket))
        listening.add_done_callback(lambda _: wake.set())
        try:
            told = 0
            while not listening.done():
                wake.clear()
                while told < len(self._texts):
                    await socket.send(self._texts[told])
                    told += 1
                if self._over:
                    self._seen_to_the_end.set()
                    return
                await wake.wait()
        finally:
            self._viewers.discard(wake)
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)


async def _listen(socket: WebSocket) -> None:
    """Hear a viewer out until it leaves: pings are answered on the way, and it has nothing else to say."""
    while await socket.receive() is not None:
        pass
