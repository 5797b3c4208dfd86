"""Text in stretches of some megabytes, as the compiled reader takes it. Begin with `stretches`, then `Stretch.load`.

A stretch is many short files or a piece of a long one. Short files stand one behind the other in its bytes, so that a
thousand of them cost no more than one long one.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.logs.kernels import fields, rows
from racecraft.worlds.deepracer.logs.texts import Text

STRETCH_BYTES = 2 << 20
LONGEST_LINE = 1 << 16
"""How far the last line of a piece may reach over its end; a row of a trace is some two hundred bytes."""
_NEW_LINE = ord("\n")
_LEAST_ROOM = 4 << 20
"""From so many bytes on NumPy asks for pages of two megabytes, and a few of them come sooner than a thousand small."""


@dataclass(frozen=True)
class Piece:
    """The lines of a text that begin from `begin` up to before `end`."""

    text: Text
    begin: int
    end: int

    @property
    def is_first(self) -> bool:
        """Whether the text begins with it."""
        return self.begin == self.text.begin


@dataclass(frozen=True)
class Loaded:
    """The bytes of a stretch; the next stretch that the same thread loads takes their room."""

    text: Array
    """uint8, with ZEROS_BEHIND zeros behind."""
    end: int
    """From here on no line begins."""
    begins_whole: bool
    """Whether a line begins at byte 0; else behind the first end of a line."""
    lines: list[int]
    """How many lines begin in each piece."""


@dataclass(frozen=True)
class Stretch:
    """What one thread reads at a time: whole texts, or one piece of a text."""

    pieces: tuple[Piece, ...]

    @property
    def bytes(self) -> int:
        """How many bytes the pieces have."""
        return sum(piece.end - piece.begin for piece in self.pieces)

    def load(self) -> Loaded:
        """Read it."""
        first = self.pieces[0]
        if first.is_first and all(piece.end == piece.text.size for piece in self.pieces):
            return self._load_whole()
        return _load_piece(first)

    def _load_whole(self) -> Loaded:
        """Read whole texts, each with the end of a line behind its last one."""
        room = _room(self.bytes + len(self.pieces))
        view, ends, at = room.data, [], 0  # sooner looked into than an array
        for piece in self.pieces:
            begin, at = at, at + piece.text.read_into(view[at : at + piece.end - piece.begin], piece.begin)
            if at > begin and view[at - 1] != _NEW_LINE:
                view[at] = _NEW_LINE
                at += 1
            ends.append(at)
        return Loaded(_closed(room, at), at, True, _lines_in(room, ends))


def stretches(texts: Sequence[Text]) -> Iterator[Stretch]:
    """Cut texts into stretches of about STRETCH_BYTES, in order."""
    some: list[Piece] = []
    size = 0
    for text in texts:
        length = text.size - text.begin
        if some and size + length > STRETCH_BYTES:
            yield Stretch(tuple(some))
            some, size = [], 0
        if length > STRETCH_BYTES:
            for begin in range(text.begin, text.size, STRETCH_BYTES):
                yield Stretch((Piece(text, begin, min(begin + STRETCH_BYTES, text.size)),))
        else:
            some.append(Piece(text, text.begin, text.size))
            size += length
    if some:
        yield Stretch(tuple(some))


def _load_piece(piece: Piece) -> Loaded:
    """Read a piece, with the byte before it, which tells whether a line begins with it, and LONGEST_LINE behind it."""
    before = 0 if piece.is_first else 1
    begin, end = piece.begin - before, min(piece.end + LONGEST_LINE, piece.text.size)
    room = _room(end - begin)
    length = piece.text.read_into(room[: end - begin].data, begin)
    stop = piece.end - begin
    (ends,) = _lines_in(room, [max(min(stop, length) - 1, 0)])
    return Loaded(_closed(room, length), stop, not before, [ends + (not before)])


def _lines_in(text: Array, ends: Sequence[int]) -> list[int]:
    """Return how many lines end in each of the texts that stand here one behind the other."""
    counts = np.empty(len(ends), np.int64)
    rows.count_lines(text, np.array(ends, np.int64), counts)
    return [int(count) for count in counts]


_rooms = threading.local()


def _room(size: int) -> Array:
    """Return bytes to fill, with what the kernels look at before and behind them; one room for each thread.

    A fresh one for every stretch would cost a fifth of its reading: memory that a process has never had comes dear.
    """
    needed = max(fields.BYTES_BEFORE + size + rows.ZEROS_BEHIND, _LEAST_ROOM)
    if len(room := getattr(_rooms, "bytes", np.empty(0, np.uint8))) < needed:
        room = _rooms.bytes = np.empty(needed, np.uint8)
    return room[fields.BYTES_BEFORE :]


def _closed(room: Array, length: int) -> Array:
    """Return the text up to here, with zeros behind."""
    room[length : length + rows.ZEROS_BEHIND] = 0
    return room[: length + rows.ZEROS_BEHIND]
