"""An API for programs: whole requests in, JSON out. Begin with `JsonApi`.

Pages are Starlette's routes (`application.py`). A webhook that answers 200 games at once and an endpoint are asked by
programs, two thousand times a second, and need neither pages, forms, compression nor patterns of paths: here one
function answers every request, on uvicorn without a layer between (docs/decisions: what each way costs).
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

import msgspec
from starlette.types import ASGIApp, Receive, Scope, Send

from racecraft.contract.errors import UserInputError
from racecraft.web.access import ANYONE, Access, Guard
from racecraft.web.errors import WebError
from racecraft.web.limits import MAX_BODY_BYTES, arrived

JSON = "application/json"


@dataclass(frozen=True)
class ApiRequest:
    """A whole request."""

    method: str
    path: str
    body: bytes = b""
    arrived: float = 0.0
    """`time.monotonic()` at its first byte."""
    raw_headers: tuple[tuple[bytes, bytes], ...] | list[tuple[bytes, bytes]] = ()
    """Names in small letters."""

    def header(self, name: str) -> str:
        """Return a header's value; "" where there is none."""
        wanted = name.encode()
        return next((value.decode("latin-1") for key, value in self.raw_headers if key == wanted), "")

    def json(self) -> Any:
        """Return the value of the body; its numbers are finite, its depth is bounded.

        Raises:
            WebError: 400 bad_json.
        """
        try:
            return msgspec.json.decode(self.body)
        except RecursionError:
            raise WebError(400, "bad_json", "the JSON is nested too deep; expected some hundred levels.") from None
        except (msgspec.MsgspecError, UnicodeDecodeError) as error:
            raise WebError(400, "bad_json", f"the body is not JSON ({str(error)[:120]}); expected JSON.") from error


@dataclass(frozen=True)
class Reply:
    """An answer that is not just a JSON value."""

    body: bytes
    kind: str = JSON
    """Content-Type."""
    status: int = 200


Answer = Callable[[ApiRequest], Awaitable[Any]]


class JsonApi:
    """An ASGI application of one function.

    Args:
        answer: Returns the JSON value of an answer or a `Reply`, or raises a `WebError`.
        most_body: Bytes of a body.
        begin: Called in the server's loop before the first request.
        end: Called in the server's loop behind the last.
    """

    def __init__(
        self,
        answer: Answer,
        most_body: int = MAX_BODY_BYTES,
        begin: Callable[[], None] = lambda: None,
        end: Callable[[], None] = lambda: None,
    ) -> None:
        self._answer, self._most_body, self._begin, self._end = answer, most_body, begin, end

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] == "lifespan":
            await self._live(receive, send)
            return
        try:
            body = await self._read(scope, receive)
            if body is None:
                return
            request = ApiRequest(scope["method"], scope["path"], body, arrived(scope), scope["headers"])
            value = await self._answer(request)
            reply = value if isinstance(value, Reply) else Reply(msgspec.json.encode(value))
        except WebError as error:
            reply = _error(error.status, error.name, error.sentence)
        except UserInputError as error:
            reply = _error(422, "not_usable", str(error))
        except Exception as error:  # one request never takes the server down
            reply = _error(500, "internal", f"{type(error).__name__}: {str(error)[:200]}")
        headers = [(b"content-type", reply.kind.encode()), (b"content-length", b"%d" % len(reply.body))]
        await send({"type": "http.response.start", "status": reply.status, "headers": headers})
        await send({"type": "http.response.body", "body": reply.body})

    async def _live(self, receive: Receive, send: Send) -> None:
        """Begin and end with the server."""
        await receive()
        self._begin()
        await send({"type": "lifespan.startup.complete"})
        await receive()
        self._end()
        await send({"type": "lifespan.shutdown.complete"})

    async def _read(self, scope: Scope, receive: Receive) -> bytes | None:
        """Return the whole body; None where the client has gone.

        Raises:
            WebError: 413 body_too_large, 415 content_encoding.
        """
        for name, value in scope["headers"]:
            if name == b"content-length" and int(value) > self._most_body:
                raise self._too_large()
            if name == b"content-encoding" and value != b"identity":
                found = value.decode("latin-1")[:40]
                raise WebError(415, "content_encoding", f"the body is packed ({found}); expected it as it is.")
        body = b""
        while True:
            message = await receive()
            if message["type"] == "http.disconnect":
                return None
            body = body + message["body"] if body else message["body"]
            if len(body) > self._most_body:
                raise self._too_large()
            if not message.get("more_body", False):
                return body

    def _too_large(self) -> WebError:
        return WebError(413, "body_too_large", f"the body is too large; expected at most {self._most_body:,} bytes.")


def guarded(api: JsonApi, access: Access) -> ASGIApp:
    """Return the application behind a check of who may ask; as it is where anyone may."""
    return api if access == ANYONE else Guard(api, access)


def _error(status: int, name: str, sentence: str) -> Reply:
    return Reply(msgspec.json.encode({"error": name, "message": sentence}), status=status)
