"""Bodies as clients of S3 send them: of known length, in HTTP's chunks, in AWS's own chunks. See `body_pieces`.

AWS's chunks (`aws-chunked`) are lines "SIZE[;chunk-signature=…]" with so many bytes behind each, a last one of size 0,
and trailers. Their signatures are not looked at: who asks is told by the head.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Protocol

from racecraft.serving.buckets.xml import S3Error

BLOCK = 1 << 20
MOST_BYTES = 5 * 2**40
"""S3's own limit for an object."""
_MOST_LINE = 4096


class Readable(Protocol):
    """What comes behind a head."""

    def read(self, size: int, /) -> bytes:
        """Return up to so many bytes; none at the end."""
        ...

    def readline(self, most: int, /) -> bytes:
        """Return up to and with the next line end, or so many bytes."""
        ...


class BrokenBodyError(S3Error):
    """The body broke off: the connection is of no more use."""

    def __init__(self) -> None:
        super().__init__(400, "IncompleteBody", "The body broke off before its end; nothing was changed.")


def body_pieces(file: Readable, headers: Mapping[str, str]) -> Iterator[bytes]:
    """Yield a request's body, piece by piece, without what it was wrapped in.

    Args:
        file: What comes behind the head.
        headers: Names in small letters.

    Raises:
        BrokenBodyError: It ended too soon.
        S3Error: No length is told, or the wrapping is wrong.
    """
    if headers.get("transfer-encoding", "").lower() == "chunked":
        pieces = _chunks(file)
    else:
        pieces = _counted(file, _length(headers))
    if "aws-chunked" not in headers.get("content-encoding", "") and not headers.get(
        "x-amz-content-sha256", ""
    ).startswith("STREAMING-"):
        yield from pieces
        return
    inner = _PieceReader(pieces)
    total = 0
    for piece in _chunks(inner):
        total += len(piece)
        yield piece
    told = headers.get("x-amz-decoded-content-length", "")
    if told and told != str(total):
        raise BrokenBodyError


def _length(headers: Mapping[str, str]) -> int:
    text = headers.get("content-length", "")
    if not text:
        return 0
    if not (text.isascii() and text.isdigit()) or int(text) > MOST_BYTES:
        raise S3Error(400, "InvalidArgument", f"Content-Length is {text[:40]!r}; expected a number of bytes.")
    return int(text)


def _counted(file: Readable, length: int) -> Iterator[bytes]:
    while length > 0:
        piece = file.read(min(BLOCK, length))
        if not piece:
            raise BrokenBodyError
        length -= len(piece)
        yield piece


def _chunks(file: Readable) -> Iterator[bytes]:
    while True:
        line = file.readline(_MOST_LINE)
        if not line.endswith(b"\n"):
            raise BrokenBodyError
        try:
            size = int(line.split(b";")[0].strip(), 16)
        except ValueError:
            raise S3Error(400, "InvalidRequest", "The body's chunks are malformed.") from None
        if size <= 0:
            break
        while size > 0:
            piece = file.read(min(BLOCK, size))
            if not piece:
                raise BrokenBodyError
            size -= len(piece)
            yield piece
        if file.readline(_MOST_LINE) not in (b"\r\n", b"\n"):
            raise BrokenBodyError
    while line := file.readline(_MOST_LINE):  # trailers, up to an empty line
        if line in (b"\r\n", b"\n"):
            return


class _PieceReader:
    """Reads pieces as if they were a file."""

    def __init__(self, pieces: Iterator[bytes]) -> None:
        self._pieces, self._held = pieces, b""

    def read(self, size: int) -> bytes:
        """Return up to so many bytes; none at the end."""
        if not self._held:
            self._held = next(self._pieces, b"")
        taken, self._held = self._held[:size], self._held[size:]
        return taken

    def readline(self, most: int) -> bytes:
        """Return up to and with the next line end."""
        line = b""
        while len(line) < most and not line.endswith(b"\n"):
            if not self._held:
                self._held = next(self._pieces, b"")
                if not self._held:
                    break
            end = self._held.find(b"\n") + 1 or len(self._held)
            line, self._held = line + self._held[:end], self._held[end:]
        return line
