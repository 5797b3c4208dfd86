"""The plainly sound rows of texts, read by compiled code on every core. Begin with `read_sound_rows`.

Each stretch is loaded, its lines are counted, and it is given its place in the table; then its rows are read right into
that place while other stretches are read into theirs. Where every line was a sound row nothing is moved afterwards.
"""

from __future__ import annotations

import itertools
import os
import threading
from collections.abc import Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.episodes import STATUSES
from racecraft.worlds.deepracer.files.sim_trace import TRACE_COLUMNS
from racecraft.worlds.deepracer.logs.kernels import rows
from racecraft.worlds.deepracer.logs.stretches import Loaded, Piece, Stretch, stretches
from racecraft.worlds.deepracer.logs.texts import Text
from racecraft.worlds.deepracer.logs.units import OURS

if TYPE_CHECKING:
    import polars as pl

SPARE = 1.05
"""Room for so many times the lines that are to be expected."""


@dataclass(frozen=True)
class SoundRows:
    """What texts hold that is plainly sound, and what is left for someone slower."""

    frame: pl.DataFrame
    """AWS's columns in our units, `line` and `file`."""
    odd: list[tuple[Text, list[tuple[int, str]]]]
    """Line and words of each row that is not plainly sound, text by text."""
    between: bytes
    """The other lines of logs."""


def read_sound_rows(
    header: Sequence[str], texts: Sequence[Text], marked: bool, wanted: Collection[str] | None
) -> SoundRows:
    """Read them; arguments as of `rows_of_text.read_rows`."""
    some = list(stretches(texts))
    table = _Table(_Columns(header, wanted), sum(text.size for text in texts))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = list(pool.map(lambda place: table.read(place, some[place], marked), range(len(some))))
    odd = [one for found_here in found for one in found_here.odd]
    by_text = [(text, [row for _, row in group]) for text, group in itertools.groupby(odd, key=lambda one: one[0])]
    return SoundRows(table.frame(found), by_text, b"".join(one.between for one in found))


class _Columns:
    """Which field of a row goes where.

    Args:
        header: AWS's names of the columns in the order of the fields; other names are passed over.
        wanted: Names of the columns that are asked for; None: all.
    """

    def __init__(self, header: Sequence[str], wanted: Collection[str] | None) -> None:
        by_type = {"float64": rows.FLOAT, "int64": rows.WHOLE, "bool": rows.FLAG, "str": rows.STATUS}
        kinds = {column.name: by_type[column.dtype] for column in TRACE_COLUMNS}
        kinds |= {"action": rows.ACTION, "steps": rows.WHOLE}
        unasked = [name for name, kind in kinds.items() if kind == rows.FLOAT and wanted is not None]
        kinds |= {name: rows.CHECKED for name in unasked if name not in (wanted or ())}
        self.kinds = np.array([kinds.get(name, rows.SKIPPED) for name in header])
        self.floats = [name for name in header if kinds.get(name) == rows.FLOAT]
        self.units = np.array([OURS.get(name, (1.0, 1.0)) for name in self.floats]).reshape(-1, 2)
        self.wholes = [name for name in header if kinds.get(name) in (rows.WHOLE, rows.ACTION)]
        self.flags = [name for name in header if kinds.get(name) == rows.FLAG]
        self.has_status = "episode_status" in header
        self.statuses = np.array(
            [[rows.word(word[:8]), rows.word(word[8:]), np.uint64(len(word))] for word in STATUSES]
        )


class _Room:
    """Memory of all columns for so many rows; what is never written costs nothing."""

    def __init__(self, columns: _Columns, count: int) -> None:
        self.count, self.taken = count, 0
        self.floats = np.empty((len(columns.floats), count))
        self.wholes = np.empty((len(columns.wholes), count), np.int32)
        self.flags = np.empty((len(columns.flags), count), bool)
        self.status = np.empty(count, np.uint8)
        self.lines, self.files = np.empty(count, np.int32), np.empty(count, np.uint32)

    def by_name(self, columns: _Columns) -> dict[str, Array]:
        """Return the columns; a status is its index in STATUSES."""
        named: dict[str, Array] = dict(zip(columns.floats, self.floats, strict=True))
        named |= dict(zip(columns.wholes, self.wholes, strict=True))
        named |= dict(zip(columns.flags, self.flags, strict=True))
        if columns.has_status:
            named["episode_status"] = self.status
        return named | {"line": self.lines, "file": self.files}


@dataclass(frozen=True)
class _Place:
    """Where a stretch's rows go."""

    room: _Room
    begin: int
    first_lines: list[int]
    """Number of the first line of each piece."""


@dataclass(frozen=True)
class _Found:
    """What a stretch held."""

    place: _Place
    count: int
    """How many sound rows it has."""
    odd: list[tuple[Text, tuple[int, str]]]
    between: bytes

    @property
    def end(self) -> int:
        """Behind the last row in its room."""
        return self.place.begin + self.count


class _Table:
    """The sound rows of all stretches; any number of threads may read stretches into it, each asked in their order.

    Args:
        columns: Which columns.
        size: Bytes of all texts.
    """

    def __init__(self, columns: _Columns, size: int) -> None:
        self._columns, self._bytes_left = columns, size
        self._turn, self._turns = 0, threading.Condition()
        self._room: _Room | None = None
        self._line = 0

    def read(self, turn: int, stretch: Stretch, marked: bool) -> _Found:
        """Read the stretch whose turn this is."""
        try:
            loaded = stretch.load()
        except BaseException:
            self._place(turn, stretch, [0 for _ in stretch.pieces])  # else those that follow would wait for ever
            raise
        place = self._place(turn, stretch, loaded.lines)
        return self._read_into(place, stretch.pieces, loaded, marked)

    def _place(self, turn: int, stretch: Stretch, lines: list[int]) -> _Place:
        """Return room for so many lines, behind the stretch before; wait until that has its own."""
        with self._turns:
            self._turns.wait_for(lambda: self._turn == turn)
            count = sum(lines)
            if self._room is None or self._room.taken + count > self._room.count:
                expected = count * self._bytes_left / max(stretch.bytes, 1) * SPARE
                self._room = _Room(self._columns, max(count, int(expected)) + 1)
            begin = self._room.taken
            self._room.taken += count
            self._bytes_left -= stretch.bytes
            first_lines = []
            for piece, more in zip(stretch.pieces, lines, strict=True):
                first_lines.append(piece.text.line if piece.is_first else self._line)
                self._line = first_lines[-1] + more
            self._turn += 1
            self._turns.notify_all()
            return _Place(self._room, begin, first_lines)

    def _read_into(self, place: _Place, pieces: Sequence[Piece], loaded: Loaded, marked: bool) -> _Found:
        room, columns, text = place.room, self._columns, loaded.text
        lines = sum(loaded.lines)
        ends = np.cumsum(loaded.lines)
        lifts = np.array(place.first_lines) - ends + loaded.lines
        files = [piece.text.place for piece in pieces]
        odd, gaps = np.empty((lines, 3), np.int32), np.empty((lines if marked else 0, 2), np.int32)
        count, odds, gap_count, _ = rows.read_lines(
            text, loaded.end, loaded.begins_whole, marked, columns.kinds, columns.units, columns.statuses,
            np.column_stack([ends, lifts, files]), place.begin, room.floats, room.wholes, room.flags, room.status,
            room.lines, room.files, odd, gaps,
        )  # fmt: skip
        left = []
        for begin, end, line in odd[:odds]:
            piece = int(np.searchsorted(ends, line, side="right"))
            left.append((pieces[piece].text, (int(line + lifts[piece]), _words_of(text[begin:end]))))
        between = b"".join(text[begin:end].tobytes() for begin, end in gaps[:gap_count])
        return _Found(place, count, left, between)

    def frame(self, found: Sequence[_Found]) -> pl.DataFrame:
        """Return the rows of stretches in order; where every line was one, columns lie where they were read."""
        import polars as pl

        runs: list[tuple[_Room, int, int]] = []
        for one in found:
            if runs and runs[-1][0] is one.place.room and runs[-1][2] == one.place.begin:
                runs[-1] = (*runs[-1][:2], one.end)
            else:
                runs.append((one.place.room, one.place.begin, one.end))
        return pl.concat([self._frame_of(*run) for run in runs], rechunk=True)

    def _frame_of(self, room: _Room, begin: int, end: int) -> pl.DataFrame:
        import polars as pl

        def column(name: str, values: Array) -> pl.Series:
            if name == "episode_status":
                return pl.Series(name, STATUSES, pl.Enum(STATUSES)).gather(pl.Series(values.astype(np.uint32)))
            return pl.Series(name, values)

        named = room.by_name(self._columns)
        return pl.DataFrame([column(name, values[begin:end]) for name, values in named.items()])


def _words_of(text: Array) -> str:
    """Return a row as text, without what a log wrote behind a tab."""
    return text.tobytes().decode("utf-8", errors="replace").split("\t", 1)[0].rstrip("\r\n\0")
