"""Messages between two processes: a head of JSON and a body of bytes. Never pickle.

4 bytes   length of the head, little-endian
4 bytes   length of the body
head      JSON, UTF-8; may be empty
body      bytes; what they mean is agreed by those who talk
"""

from __future__ import annotations

import json
import os
import struct
from typing import Any

LENGTHS = struct.Struct("<II")
READ_BYTES = 1 << 16
MAX_HEAD_BYTES, MAX_BODY_BYTES = 1 << 20, 1 << 26
"""A head of 1 MiB, a body of 64 MiB; whoever claims more is not listened to."""


class ChannelError(Exception):
    """What came is no message."""


class Channel:
    """One end of two pipes.

    Args:
        reads: File descriptor that messages come in by.
        writes: File descriptor that they leave by.
        most: Longest head and body that are taken, bytes.
    """

    def __init__(self, reads: int, writes: int, most: tuple[int, int] = (MAX_HEAD_BYTES, MAX_BODY_BYTES)) -> None:
        self._reads, self._writes, self._most = reads, writes, most
        self._came = bytearray()

    def send(self, head: bytes, body: bytes = b"") -> None:
        """Send a message.

        Raises:
            OSError: Nobody listens any more.
        """
        message = memoryview(b"".join((LENGTHS.pack(len(head), len(body)), head, body)))
        while message:
            message = message[os.write(self._writes, message) :]

    def receive(self) -> tuple[bytes, bytes]:
        """Wait for a message; return its head and its body.

        Raises:
            EOFError: The other end is closed.
            ChannelError: A message is longer than any may be.
        """
        self._wait_for(LENGTHS.size)
        head, body = LENGTHS.unpack_from(self._came)
        if head > self._most[0] or body > self._most[1]:
            raise ChannelError(f"a message of {head + body:,} bytes")
        end = LENGTHS.size + head + body
        self._wait_for(end)
        whole = bytes(self._came[LENGTHS.size : end])
        del self._came[:end]
        return whole[:head], whole[head:]

    def _wait_for(self, count: int) -> None:
        while len(self._came) < count:
            came = os.read(self._reads, READ_BYTES)
            if not came:
                raise EOFError
            self._came += came


def to_head(value: Any) -> bytes:
    """Return a value as a message's head."""
    return json.dumps(value, separators=(",", ":")).encode()


def from_head(head: bytes) -> dict[str, Any]:
    """Return the dictionary that a head holds; of an empty head an empty one.

    Raises:
        ChannelError: It holds something else.
    """
    if not head:
        return {}
    try:
        value = json.loads(head)
    except (ValueError, RecursionError):
        raise ChannelError("a head that is no JSON") from None
    if not isinstance(value, dict):
        raise ChannelError("a head that is no dictionary")
    return value
