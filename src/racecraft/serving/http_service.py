"""A small HTTP/1.1 server on asyncio: whole requests in, JSON out; what cannot be a request gets a named error.

It does what a webhook and a page for watching need and no more: methods with and without a body of known length,
connections kept open, a cap on headers, bodies and waiting; a connection may become a WebSocket (`web_socket.py`).
A request that is cut, huge or no HTTP never reaches the handler.
"""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Awaitable, Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, SupportsIndex
from urllib.parse import parse_qsl

from racecraft.serving.web_socket import GOING_AWAY, WebSocket, accept_key, is_key

MOST_HEADER_BYTES = 16 * 1024
MOST_BODY_BYTES = 1024 * 1024
SECONDS_FOR_A_REQUEST = 10.0
"""From the first byte of a request to its last."""
IDLE_SECONDS = 120.0
LINGER_SECONDS = 1.0
"""How long a connection that ends with an error is still read, and what comes thrown away."""
MOST_CONNECTIONS = 2000

_REASONS = {
    200: "OK", 400: "Bad Request", 404: "Not Found", 405: "Method Not Allowed", 408: "Request Timeout",
    411: "Length Required", 413: "Content Too Large", 415: "Unsupported Media Type",
    422: "Unprocessable Content", 426: "Upgrade Required",
    431: "Request Header Fields Too Large", 500: "Internal Server Error", 503: "Service Unavailable",
}  # fmt: skip


class HttpError(Exception):
    """A request that is answered with an error.

    Args:
        status: HTTP status.
        name: One word for programs, such as "bad_json".
        letter: A sentence for people.
    """

    def __init__(self, status: int, name: str, letter: str) -> None:
        super().__init__(letter)
        self.status, self.name, self.letter = status, name, letter


@dataclass(frozen=True)
class Request:
    """A whole request."""

    method: str
    path: str
    body: bytes
    arrived: float
    """`time.monotonic()` when its first bytes were read off the socket."""
    keep_open: bool
    headers: dict[str, str] = field(default_factory=dict)
    """Names in small letters."""
    query: dict[str, str] = field(default_factory=dict)
    """What stands behind the ? of the address; of two with one name the last."""

    def json(self) -> Any:
        """Return the body's value, or raise an `HttpError` (bad_json)."""
        try:
            return json.loads(self.body)
        except RecursionError:
            raise HttpError(400, "bad_json", "the JSON is nested too deep.") from None
        except ValueError as error:
            raise HttpError(400, "bad_json", f"the body is no JSON: {str(error)[:120]}.") from error


@dataclass(frozen=True)
class Reply:
    """An answer that is not just a JSON object."""

    body: bytes
    kind: str = "application/json"
    """Content-Type."""
    headers: tuple[tuple[str, str], ...] = ()
    status: int = 200


@dataclass(frozen=True)
class Upgrade:
    """The answer that makes a WebSocket of the connection."""

    talk: Callable[[WebSocket], Awaitable[None]]
    """Holds the conversation; the connection closes when it returns."""


Handler = Callable[[Request], Awaitable[dict[str, Any] | Reply | Upgrade]]


class HttpService:
    """Listens on one address and gives whole requests to a handler.

    Args:
        handler: Returns the JSON object of the answer, a `Reply` or an `Upgrade`, or raises an `HttpError`.
    """

    def __init__(self, handler: Handler) -> None:
        self._handler = handler
        self._connections: set[asyncio.Task[None]] = set()
        self._server: asyncio.Server | None = None

    async def listen(self, host: str, port: int) -> int:
        """Begin to listen; return the port (a free one was chosen where 0 was asked for). Raises OSError."""
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(
            lambda: asyncio.StreamReaderProtocol(_StampedReader(MOST_HEADER_BYTES, loop), self._connected, loop),
            host, port, backlog=1024,
        )  # fmt: skip
        return int(self._server.sockets[0].getsockname()[1])

    async def close(self) -> None:
        """Stop listening and drop what is open."""
        if self._server is not None:
            self._server.close()
        tasks = list(self._connections)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _connected(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._connections.add(task)
        try:
            await self._converse(reader, writer)
        except (ConnectionError, asyncio.IncompleteReadError, asyncio.CancelledError):
            pass  # gone, or we close; nobody is left to be told
        finally:
            self._connections.discard(task)
            writer.close()
            with suppress(ConnectionError, OSError, asyncio.CancelledError):
                await writer.wait_closed()

    async def _converse(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if len(self._connections) > MOST_CONNECTIONS:
            await _write(writer, _error(503, "too_many_connections", "try again later."), False)
            await _linger(reader, writer)
            return
        keep_open = True
        while keep_open:
            try:
                request = await _read(reader)
                if request is None:
                    return
                keep_open = request.keep_open
                answer = await self._handler(request)
                if isinstance(answer, Upgrade):
                    await _agree(request, writer)
            except HttpError as error:
                answer = _error(error.status, error.name, error.letter)
                keep_open = keep_open and error.status in (404, 405, 415, 422)
            except TimeoutError:
                answer, keep_open = _error(408, "too_slow", "the request did not arrive in time."), False
            except (ConnectionError, asyncio.IncompleteReadError):
                raise
            except Exception as error:  # never let one request take the server down
                answer = _error(500, "internal", f"{type(error).__name__}: {str(error)[:200]}")
                keep_open = False
            if isinstance(answer, Upgrade):
                await _talk(answer, WebSocket(reader, writer))
                return
            await _write(writer, answer, keep_open)
            if not keep_open and isinstance(answer, Reply) and answer.status >= 400:
                await _linger(reader, writer)


class _StampedReader(asyncio.StreamReader):
    """Knows when a request's first bytes were read off the socket: whoever takes it apart may wait long for a turn."""

    first_bytes: float | None = None

    def feed_data(self, data: Iterable[SupportsIndex]) -> None:
        """Take bytes that came."""
        if self.first_bytes is None:
            self.first_bytes = time.monotonic()
        super().feed_data(data)


async def _read(reader: asyncio.StreamReader) -> Request | None:
    """Return the next request; None where the other end closed instead."""
    try:
        async with asyncio.timeout(IDLE_SECONDS):
            line = await reader.readline()
    except TimeoutError:
        return None
    except ValueError:
        raise HttpError(431, "headers_too_large", "the first line is too long.") from None
    if not line:
        return None
    arrived = (isinstance(reader, _StampedReader) and reader.first_bytes) or time.monotonic()
    async with asyncio.timeout(SECONDS_FOR_A_REQUEST):
        try:
            method, target, version = line.decode("ascii").split()
        except ValueError:
            raise HttpError(400, "bad_request", "this is no HTTP request.") from None
        headers = await _read_headers(reader)
        body = await _read_body(reader, headers, method)
    if isinstance(reader, _StampedReader):
        reader.first_bytes = None
    keep_open = version == "HTTP/1.1" and headers.get("connection", "").lower() != "close"
    path, _, query = target.partition("?")
    return Request(method, path, body, arrived, keep_open, headers, dict(parse_qsl(query)))


async def _read_headers(reader: asyncio.StreamReader) -> dict[str, str]:
    headers: dict[str, str] = {}
    total = 0
    while True:
        try:
            line = await reader.readline()
        except ValueError:
            raise HttpError(431, "headers_too_large", "a header line is too long.") from None
        total += len(line)
        if total > MOST_HEADER_BYTES:
            raise HttpError(431, "headers_too_large", f"more than {MOST_HEADER_BYTES} bytes of headers.")
        if not line.endswith(b"\n"):
            raise asyncio.IncompleteReadError(line, None)
        if line in (b"\r\n", b"\n"):
            return headers
        name, colon, value = line.decode("latin-1").partition(":")
        if not colon:
            raise HttpError(400, "bad_request", "a header line without a colon.")
        name, value = name.strip().lower(), value.strip()
        if name == "content-length" and headers.get(name, value) != value:
            raise HttpError(400, "bad_request", "two different Content-Lengths.")
        headers[name] = value


async def _read_body(reader: asyncio.StreamReader, headers: dict[str, str], method: str) -> bytes:
    if "transfer-encoding" in headers:
        raise HttpError(411, "length_required", "send the body with a Content-Length, not in chunks.")
    if "content-length" not in headers:
        if method == "POST":
            raise HttpError(411, "length_required", "a POST needs a Content-Length.")
        return b""
    text = headers["content-length"]
    if not (text.isascii() and text.isdigit()):
        raise HttpError(400, "bad_request", f"Content-Length is {text[:40]!r}.")
    if len(text) > 9 or int(text) > MOST_BODY_BYTES:
        raise HttpError(413, "body_too_large", f"the body has {text[:20]} bytes; expected at most {MOST_BODY_BYTES}.")
    return await reader.readexactly(int(text))


async def _write(writer: asyncio.StreamWriter, answer: dict[str, Any] | Reply, keep_open: bool) -> None:
    if not isinstance(answer, Reply):
        answer = Reply(json.dumps(answer, separators=(",", ":")).encode())
    more = "".join(f"{name}: {value}\r\n" for name, value in answer.headers)
    head = (
        f"HTTP/1.1 {answer.status} {_REASONS.get(answer.status, 'Error')}\r\nContent-Type: {answer.kind}\r\n{more}"
        f"Content-Length: {len(answer.body)}\r\nConnection: {'keep-alive' if keep_open else 'close'}\r\n\r\n"
    )
    writer.write(head.encode() + answer.body)
    await writer.drain()


async def _linger(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Let the other end read its error: closing on what it still sends would take the answer back."""
    writer.write_eof()
    with suppress(TimeoutError):
        async with asyncio.timeout(LINGER_SECONDS):
            while await reader.read(1 << 16):
                pass


def _error(status: int, name: str, letter: str) -> Reply:
    return Reply(json.dumps({"error": name, "message": letter}, separators=(",", ":")).encode(), status=status)


async def _agree(request: Request, writer: asyncio.StreamWriter) -> None:
    headers = request.headers
    key = headers.get("sec-websocket-key", "")
    asked = headers.get("upgrade", "").lower() == "websocket" and "upgrade" in headers.get("connection", "").lower()
    if not asked or headers.get("sec-websocket-version") != "13" or not is_key(key):
        raise HttpError(426, "websocket_only", "here a WebSocket is spoken: version 13, with a key of 16 bytes.")
    writer.write(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        f"Sec-WebSocket-Accept: {accept_key(key)}\r\n\r\n".encode()
    )
    await writer.drain()


async def _talk(upgrade: Upgrade, socket: WebSocket) -> None:
    try:
        await upgrade.talk(socket)
    finally:
        await socket.close(GOING_AWAY)
