"""The server's side of a WebSocket (RFC 6455), as much of it as a viewer needs: text both ways, ping, close.

A client's frames are masked and small; whatever breaks the rules ends the conversation with the code the RFC names.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import struct
from contextlib import suppress

MOST_MESSAGE_BYTES = 64 * 1024
"""What a viewer may say at once."""
SECONDS_TO_PART = 2.0
"""How long the other end is waited for after a close was sent."""

_GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
_CONTINUED, _TEXT, _BINARY, _CLOSE, _PING, _PONG = 0x0, 0x1, 0x2, 0x8, 0x9, 0xA
GOING_AWAY, PROTOCOL_ERROR, NOT_TEXT, BAD_TEXT, TOO_BIG = 1001, 1002, 1003, 1007, 1009


class _BrokenRuleError(Exception):
    """The other end broke a rule; `code` says which."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


def accept_key(key: str) -> str:
    """Return what a server answers to a client's `Sec-WebSocket-Key`, by the example of the RFC (section 1.3).

    >>> accept_key("dGhlIHNhbXBsZSBub25jZQ==")
    's3pPLMBiTxaQ9kYGzzhZRbK+xOo='
    """
    return base64.b64encode(hashlib.sha1((key + _GUID).encode(), usedforsecurity=False).digest()).decode()


def is_key(key: str) -> bool:
    """Tell whether this is a client's key: 16 bytes in base 64."""
    try:
        return len(base64.b64decode(key, validate=True)) == 16
    except ValueError:
        return False


class WebSocket:
    """A conversation that was agreed on; the service made it."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer
        self._closing = False

    async def send(self, text: str) -> None:
        """Send a text; waits while the other end does not keep up. Raises ConnectionError where it has gone."""
        if self._closing:
            raise ConnectionResetError("the conversation is over")
        await self._put(_TEXT, text.encode())

    async def receive(self) -> str | None:
        """Return the next text, or None where the conversation is over. Pings are answered on the way."""
        try:
            return await self._read_text()
        except _BrokenRuleError as broken:
            await self.close(broken.code)
        except (ConnectionError, asyncio.IncompleteReadError):
            self._closing = True
        return None

    async def close(self, code: int = 1000) -> None:
        """Say goodbye, and wait a moment for the other end's."""
        if self._closing:
            return
        self._closing = True
        with suppress(ConnectionError, asyncio.IncompleteReadError, TimeoutError, _BrokenRuleError):
            await self._put(_CLOSE, struct.pack("!H", code))
            async with asyncio.timeout(SECONDS_TO_PART):
                while (await self._read_frame())[1] != _CLOSE:
                    pass

    async def _read_text(self) -> str | None:
        whole, begun = b"", False
        while True:
            last, kind, payload = await self._read_frame()
            if kind == _CLOSE:
                if not self._closing:
                    self._closing = True
                    await self._put(_CLOSE, payload[:2])
                return None
            if kind == _PING:
                await self._put(_PONG, payload)
            if kind in (_PING, _PONG):
                continue
            if begun == (kind != _CONTINUED):
                raise _BrokenRuleError(PROTOCOL_ERROR)
            if kind == _BINARY:
                raise _BrokenRuleError(NOT_TEXT)
            whole, begun = whole + payload, True
            if len(whole) > MOST_MESSAGE_BYTES:
                raise _BrokenRuleError(TOO_BIG)
            if last:
                return _text(whole)

    async def _read_frame(self) -> tuple[bool, int, bytes]:
        """Return (is the last of its message, kind, payload without its mask)."""
        first, second = await self._reader.readexactly(2)
        last, kind, length = bool(first & 0x80), first & 0x0F, second & 0x7F
        is_control = kind >= _CLOSE
        if first & 0x70 or not second & 0x80 or kind not in (_CONTINUED, _TEXT, _BINARY, _CLOSE, _PING, _PONG):
            raise _BrokenRuleError(PROTOCOL_ERROR)
        if is_control and (length > 125 or not last):
            raise _BrokenRuleError(PROTOCOL_ERROR)
        if length == 126:
            length = struct.unpack("!H", await self._reader.readexactly(2))[0]
        elif length == 127:
            length = struct.unpack("!Q", await self._reader.readexactly(8))[0]
        if length > MOST_MESSAGE_BYTES:
            raise _BrokenRuleError(TOO_BIG)
        mask = await self._reader.readexactly(4)
        payload = await self._reader.readexactly(length)
        return last, kind, bytes(byte ^ mask[n % 4] for n, byte in enumerate(payload))

    async def _put(self, kind: int, payload: bytes) -> None:
        size = len(payload)
        if size < 126:
            head = struct.pack("!BB", 0x80 | kind, size)
        elif size < 1 << 16:
            head = struct.pack("!BBH", 0x80 | kind, 126, size)
        else:
            head = struct.pack("!BBQ", 0x80 | kind, 127, size)
        self._writer.write(head + payload)
        await self._writer.drain()


def _text(payload: bytes) -> str:
    try:
        return payload.decode()
    except UnicodeDecodeError:
        raise _BrokenRuleError(BAD_TEXT) from None
