"""How much a request may be and how long it may take, while it arrives: nothing is kept to be counted later.

seconds  `LimitedProtocol`: of the first line and the headers, and of a body that stands still
bytes    `LimitedProtocol`: of the head, before a route is asked; `RequestLimits`: of the body, `MAX_BODY_BYTES` where a
         route allows no more
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping
from typing import Any

from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from racecraft.web.errors import WebError, error_answer

MAX_CONNECTIONS = 2000
MAX_HEAD_BYTES = 32 * 1024
SECONDS_FOR_A_HEAD = 10.0
LINGER_SECONDS = 2.0
MAX_BODY_BYTES = 1024 * 1024
SECONDS_FOR_A_BODY = 30.0
"""Without a byte of it arriving; a large upload may take as long as it moves."""


class RequestLimits:
    """Ends requests whose body is too large.

    Args:
        app: What is asked.
        most: Bytes of a body by the path's beginning, the longest beginning first; MAX_BODY_BYTES for all others.
    """

    def __init__(self, app: ASGIApp, most: Mapping[str, int] | None = None) -> None:
        self._app = app
        self._most = sorted((most or {}).items(), key=lambda one: -len(one[0]))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        most = next((count for start, count in self._most if scope["path"].startswith(start)), MAX_BODY_BYTES)
        length = Headers(scope=scope).get("content-length", "0")
        if length.isdigit() and (len(length) > 15 or int(length) > most):
            error = _too_large(most)
            await error_answer(Request(scope), error.status, error.name, error.sentence)(scope, receive, send)
            return
        await self._app(scope, _counted(receive, most), send)


def _counted(receive: Receive, most: int) -> Receive:
    read, more = 0, True

    async def counted() -> Message:
        nonlocal read, more
        if not more:
            return await receive()  # the other end's leaving may be waited for without end
        message = await receive()
        read += len(message.get("body", b""))
        more = message.get("more_body", False)
        if read > most:
            raise _too_large(most)
        return message

    return counted


def _too_large(most: int) -> WebError:
    return WebError(413, "body_too_large", f"the body is too large; expected at most {most:,} bytes.")


class LimitedProtocol(HttpToolsProtocol):
    """HTTP/1.1 as uvicorn speaks it, with an end to long heads and to requests that stop on their way.

    `scope["racecraft.arrived"]` is `time.monotonic()` at the first byte of a request.
    """

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin."""
        super().connection_made(transport)
        self._head_bytes, self._in_head, self._refused = 0, True, False
        self._is_arriving, self._due = False, 0.0
        self._clock: asyncio.TimerHandle | None = None
        self._end = self.loop.call_later(SECONDS_FOR_A_HEAD, self.transport.close)
        if len(self.connections) > MAX_CONNECTIONS:
            self._refuse(b"503 Service Unavailable", "too_many_connections", "too many are open; try again later.")

    def connection_lost(self, exc: Exception | None) -> None:
        """End."""
        self._stop_waiting()
        self._end.cancel()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Take bytes that came."""
        if self._refused:
            return
        self._head_bytes += len(data) if self._in_head else 0
        super().data_received(data)
        if self._in_head:
            self._require_small_head(self._head_bytes)
        if self._is_arriving:  # most come whole and need no clock
            if not self._in_head:
                self._due = time.monotonic() + SECONDS_FOR_A_BODY
            self._wait()

    def handle_websocket_upgrade(self) -> None:
        """Leave the connection to another protocol."""
        self._stop_waiting()
        super().handle_websocket_upgrade()

    def on_message_begin(self) -> None:
        """Begin a request."""
        super().on_message_begin()
        now = time.monotonic()
        self.scope["racecraft.arrived"] = now  # type: ignore[typeddict-unknown-key]
        self._is_arriving, self._due = True, now + SECONDS_FOR_A_HEAD
        self._end.cancel()

    def on_headers_complete(self) -> None:
        """Ask the application."""
        self._in_head = False
        self._require_small_head(len(self.url) + sum(len(name) + len(value) + 4 for name, value in self.headers))
        if not self._refused:
            super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """Pass on a piece of a body."""
        if not self._refused:
            super().on_body(body)

    def on_response_complete(self) -> None:
        """End an answer; of a body that was too large the rest still comes."""
        super().on_response_complete()
        if self.cycle.more_body and not self.transport.is_closing():
            self._linger()

    def on_message_complete(self) -> None:
        """End a request."""
        self._in_head, self._head_bytes = True, 0
        self._stop_waiting()
        if not self._refused:
            super().on_message_complete()

    def send_400_response(self, msg: str) -> None:
        """Answer what is no HTTP, as JSON like every other error."""
        self._refuse(b"400 Bad Request", "bad_request", "this is no HTTP request.")

    def _require_small_head(self, size: int) -> None:
        if size > MAX_HEAD_BYTES and not self._refused:
            sentence = f"the headers are too large; expected at most {MAX_HEAD_BYTES:,} bytes."
            self._refuse(b"431 Request Header Fields Too Large", "headers_too_large", sentence)

    def _wait(self) -> None:
        if self._clock is None:
            self._clock = self.loop.call_later(self._due - time.monotonic(), self._look)

    def _stop_waiting(self) -> None:
        self._is_arriving = False
        if self._clock is not None:
            self._clock.cancel()
            self._clock = None

    def _look(self) -> None:
        self._clock = None
        if self._refused:
            return
        if self.flow.read_paused:  # what came is not read
            self._due = time.monotonic() + SECONDS_FOR_A_BODY
        if time.monotonic() < self._due:
            self._wait()
        elif self._in_head or not self.cycle.response_started:
            self._refuse(b"408 Request Timeout", "too_slow", "the request did not arrive in time.")
        else:
            self.transport.close()

    def _refuse(self, status: bytes, name: str, sentence: str) -> None:
        body = f'{{"error":"{name}","message":"{sentence}"}}'.encode()
        head = b"HTTP/1.1 %b\r\ncontent-type: application/json\r\ncontent-length: %d\r\nconnection: close\r\n\r\n"
        self.transport.write(head % (status, len(body)) + body)
        self.transport.write_eof()
        self._refused = True
        self._linger()

    def _linger(self) -> None:
        """Read what is still sent for a moment, and throw it away: closing at once would take the answer back."""
        self._end.cancel()
        self._end = self.loop.call_later(LINGER_SECONDS, self.transport.close)

    def eof_received(self) -> None:
        """Close, since the other end has: nobody is left to be waited for."""
        if self._refused:
            self.transport.close()


def arrived(scope: Mapping[str, Any]) -> float:
    """Return `time.monotonic()` at a request's first byte; now where nobody looked."""
    return float(scope.get("racecraft.arrived") or time.monotonic())
