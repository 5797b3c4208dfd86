"""A snake server somewhere, asked over HTTP as the official engine asks (facts: A.10, A.11).

Whatever the server does instead of answering becomes a `PlayerError`: hanging, lying, closing, answering at length.
"""

from __future__ import annotations

import http.client
import json
import socket
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit

from racecraft.worlds.battlesnake.env.board import MOVES
from racecraft.worlds.battlesnake.players.protocol import LatePlayerError, Message, PlayerError

MAX_ANSWER_BYTES = 64 * 1024


class Remote:
    """A server by its address; keeps its connection open between turns.

    Args:
        url: Such as `http://localhost:8000`; `http` or `https`.

    Raises:
        PlayerError: This is no such address.
    """

    def __init__(self, url: str) -> None:
        try:
            parts = urlsplit(url)
            port = parts.port
        except ValueError as error:
            raise PlayerError(
                "'{url}': {error}; expected an address like http://localhost:8000.", url=url, error=error
            ) from error
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise PlayerError("'{url}' is no address; expected one like http://localhost:8000.", url=url)
        self.url = url
        self._path = parts.path.rstrip("/")
        kind = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
        self._connection = kind(parts.hostname, port)

    def appearance(self, seconds: float) -> dict[str, str]:
        """Return what the server says of itself on `GET /`, texts only."""
        reply = self._ask("GET", "/", None, seconds)
        return {key: value for key, value in reply.items() if isinstance(value, str)}

    def start(self, message: Message, seconds: float) -> None:
        """Tell it that a game begins; what it answers does not matter."""
        self._ask("POST", "/start", message, seconds, needs_json=False)

    def move(self, message: Message, seconds: float) -> str:
        """Return its move."""
        word = self._ask("POST", "/move", message, seconds).get("move")
        if not isinstance(word, str) or word not in MOVES:
            raise PlayerError(
                "{url}: move {word!r:.60}; expected one of {moves}.", url=self.url, word=word, moves=", ".join(MOVES)
            )
        return word

    def end(self, message: Message, seconds: float) -> None:
        """Tell it that a game is over."""
        self._ask("POST", "/end", message, seconds, needs_json=False)

    def disconnect(self) -> None:
        """Break off what is under way, from any thread."""
        sock = self._connection.sock
        if sock is not None:
            with suppress(OSError):
                sock.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()

    def _ask(
        self, method: str, path: str, message: Message | None, seconds: float, needs_json: bool = True
    ) -> dict[str, Any]:
        try:
            status, answer = self._exchange(method, path, message, seconds)
        except TimeoutError as error:
            self._connection.close()
            raise LatePlayerError(
                "{url}{path}: no answer within {seconds:g} s.", url=self.url, path=path, seconds=seconds
            ) from error
        except (OSError, http.client.HTTPException) as error:
            self._connection.close()
            raise PlayerError(
                "{url}{path}: {type_name}: {error}.",
                url=self.url,
                path=path,
                type_name=type(error).__name__,
                error=str(error)[:120],
            ) from error
        if status != 200:
            raise PlayerError("{url}{path}: HTTP {status}; expected 200.", url=self.url, path=path, status=status)
        return _read_json(answer, f"{self.url}{path}") if needs_json else {}

    def _exchange(self, method: str, path: str, message: Message | None, seconds: float) -> tuple[int, bytes]:
        connection = self._connection
        connection.timeout = seconds
        if connection.sock is not None:
            connection.sock.settimeout(seconds)
        body = None if message is None else json.dumps(message, separators=(",", ":")).encode()
        headers = {"Content-Type": "application/json"} if body else {}
        for again in (True, False):
            was_open = connection.sock is not None
            try:
                connection.request(method, self._path + path, body, headers)
                response = connection.getresponse()
                break
            except (ConnectionError, http.client.BadStatusLine):
                connection.close()
                if not (again and was_open):  # a connection kept open may have been closed at the other end meanwhile
                    raise
        answer = response.read(MAX_ANSWER_BYTES + 1)
        if len(answer) > MAX_ANSWER_BYTES:
            connection.close()
            raise http.client.HTTPException(f"more than {MAX_ANSWER_BYTES} bytes")
        return response.status, answer


def _read_json(answer: bytes, where: str) -> dict[str, Any]:
    try:
        value = json.loads(answer)
    except (ValueError, RecursionError) as error:
        raise PlayerError(
            "{where}: the answer is no JSON ({type_name}).", where=where, type_name=type(error).__name__
        ) from error
    if not isinstance(value, dict):
        raise PlayerError(
            "{where}: the answer is a {type_name}; expected an object.", where=where, type_name=type(value).__name__
        )
    return value
