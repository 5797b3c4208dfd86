"""Rows of simulation traces out of text, from CSV files and logs alike. Begin with `read_rows`.

Text is cut into blocks of some megabytes, and the compiled reader (`kernels/rows.py`) takes the blocks on every core.
It leaves out what is not plainly sound; `careful.py` looks at those rows one by one, takes what can be taken and names
the rest. So a damaged row costs itself and no more. Little text is read carefully as a whole: that is sooner done than
compiled code is loaded.
"""

from __future__ import annotations

import itertools
import os
import threading
from collections.abc import Collection, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.aws.sim_trace import NAMES, TRACE_COLUMNS
from racecraft.formats.episodes import STATUSES
from racecraft.logs.careful import read_carefully
from racecraft.logs.errors import Damage
from racecraft.logs.sources import Source

if TYPE_CHECKING:
    import polars as pl

MARK = "SIM_TRACE_LOG:"
LITTLE_BYTES = 8 << 20
"""Text up to which Polars alone is sooner done than compiled code is loaded."""
BLOCK_BYTES = 4 << 20
LONGEST_LINE = 1 << 16
"""How far a block's last line may reach over its end; a row of a trace is some two hundred bytes."""


@dataclass(frozen=True)
class Text:
    """A file whose rows are wanted."""

    place: int
    """Index of the file among the table's files."""
    source: Source
    begin: int = 0
    """Byte at which the first line begins."""
    line: int = 1
    """Number of that line."""


@dataclass(frozen=True)
class Rows:
    """What texts hold."""

    frame: pl.DataFrame
    """AWS's columns in AWS's units and order, then `file` and `line`; continuous actions are -1."""
    damage: list[Damage]
    between: bytes
    """The other lines of logs."""


def read_rows(
    header: Sequence[str], texts: Sequence[Text], marked: bool = False, wanted: Collection[str] | None = None
) -> Rows:
    """Read the rows of texts.

    Args:
        header: AWS's names of the columns in the order of the fields; other names are passed over.
        texts: Files whose rows have these fields, in order.
        marked: Whether rows stand behind SIM_TRACE_LOG: among other lines; else every line is a row.
        wanted: AWS's names of the columns that are asked for, None: all; others may be left out where that saves time.
            Which rows are sound does not depend on it.
    """
    if sum(text.source.size for text in texts) <= LITTLE_BYTES:
        return _joined(header, [_carefully(header, text, marked) for text in texts])
    reader = _Reader(header, marked, wanted)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = list(pool.map(reader.read, [block for text in texts for block in _blocks(text)]))
        _number_lines(found)
        sound = Rows(_below_each_other(found, pool), [], b"".join(block.between for block in found))
    odd = itertools.groupby((block for block in found if block.odd), key=lambda block: block.block.text)
    taken = [name for name in header if name in sound.frame.columns]
    rows = _joined(taken, [sound, *(_odd_rows(header, text, blocks) for text, blocks in odd)])
    more = rows.frame.height > sound.frame.height
    return replace(rows, frame=rows.frame.sort("file", "line")) if more else rows


def _carefully(header: Sequence[str], text: Text, marked: bool) -> Rows:
    """Read a text without compiled code."""
    data = text.source.read()[text.begin :]
    lines = data.decode("utf-8", errors="replace").split("\n")
    numbers: Sequence[int] = range(text.line, text.line + len(lines))
    between = b""
    if marked:
        numbers = [number for number, line in zip(numbers, lines, strict=True) if MARK in line]
        between = "\n".join(line for line in lines if MARK not in line).encode()
        lines = [line.split(MARK, 1)[1].split("\t", 1)[0] for line in lines if MARK in line]
    frame, damage = read_carefully(text.source.name, header, numbers, lines)
    return Rows(_in_file(frame, text.place), damage, between)


def _in_file(frame: pl.DataFrame, place: int) -> pl.DataFrame:
    import polars as pl

    return frame.with_columns(pl.lit(place, pl.UInt32).alias("file"))


def _joined(header: Sequence[str], pieces: Sequence[Rows]) -> Rows:
    """Put the rows of texts and blocks one below the other."""
    import polars as pl

    wanted = [*(name for name in NAMES if name in header), "file", "line"]
    frames = [piece.frame.select(wanted) for piece in pieces if piece.frame.height]
    damage = list(itertools.chain.from_iterable(piece.damage for piece in pieces))
    frame = pl.concat(frames, rechunk=True) if frames else pl.DataFrame()
    return Rows(frame, damage, b"".join(piece.between for piece in pieces))


@dataclass(frozen=True)
class _Block:
    """The lines of a text that begin from `begin` up to before `end`."""

    text: Text
    begin: int
    end: int


def _blocks(text: Text) -> list[_Block]:
    cuts = [*range(text.begin, text.source.size, BLOCK_BYTES), text.source.size]
    return [_Block(text, begin, end) for begin, end in itertools.pairwise(cuts)]


@dataclass
class _Found:
    """What the compiled reader found in a block."""

    block: _Block
    columns: dict[str, Array]
    """Those of the sound rows and `line`."""
    odd: list[tuple[int, str]]
    """Line and text of the rows that are not plainly sound."""
    between: bytes
    lines: int
    """How many lines there are."""
    first_line: int = 0
    """Number of the first line; `line` and `odd` count from it until `_number_lines` told it."""


def _number_lines(found: Sequence[_Found]) -> None:
    """Count the lines of blocks on from those before them."""
    line = 0
    for piece in found:
        if piece.block.begin == piece.block.text.begin:
            line = piece.block.text.line
        piece.first_line = line
        piece.columns["line"] += line
        line += piece.lines


def _below_each_other(found: Sequence[_Found], pool: ThreadPoolExecutor) -> pl.DataFrame:
    """Return the sound rows of blocks as one table."""
    import polars as pl

    def column(name: str) -> pl.Series:
        values = np.concatenate([piece.columns[name] for piece in found])
        if name == "episode_status":
            return pl.Series(name, STATUSES, pl.Enum(STATUSES)).gather(values)
        return pl.Series(name, values)

    places = np.array([piece.block.text.place for piece in found], np.uint32)
    files = np.repeat(places, [len(piece.columns["line"]) for piece in found])
    return pl.DataFrame([*pool.map(column, found[0].columns), pl.Series("file", files)])


def _odd_rows(header: Sequence[str], text: Text, blocks: Iterable[_Found]) -> Rows:
    """Read the rows of a text carefully that are not plainly sound."""
    odd = [(block.first_line + line, row) for block in blocks for line, row in block.odd]
    frame, damage = read_carefully(text.source.name, header, [line for line, _ in odd], [row for _, row in odd])
    return Rows(_in_file(frame, text.place), damage, b"")


class _Reader:
    """Reads blocks with the compiled reader; any number of threads may ask it at once."""

    def __init__(self, header: Sequence[str], marked: bool, wanted: Collection[str] | None) -> None:
        from racecraft.logs.kernels import fields, rows

        by_type = {"float64": rows.FLOAT, "int64": rows.WHOLE, "bool": rows.FLAG, "str": rows.STATUS}
        kinds = {column.name: by_type[column.dtype] for column in TRACE_COLUMNS}
        kinds |= {"action": rows.ACTION, "steps": rows.WHOLE}
        unasked = [name for name, kind in kinds.items() if kind == rows.FLOAT and wanted is not None]
        kinds |= {name: rows.CHECKED for name in unasked if name not in (wanted or ())}
        self._kernels, self._bytes_before = rows, fields.BYTES_BEFORE
        self._thread = threading.local()
        self._marked = marked
        self._kinds = np.array([kinds.get(name, rows.SKIPPED) for name in header])
        self._floats = [name for name in header if kinds.get(name) == rows.FLOAT]
        self._wholes = [name for name in header if kinds.get(name) in (rows.WHOLE, rows.ACTION)]
        self._flags = [name for name in header if kinds.get(name) == rows.FLAG]
        self._has_status = "episode_status" in header
        self._statuses = np.array(
            [[rows.word(word[:8]), rows.word(word[8:]), np.uint64(len(word))] for word in STATUSES]
        )

    def read(self, block: _Block) -> _Found:
        """Read a block."""
        before = int(block.begin > block.text.begin)  # where a block begins with a line, the byte before it tells
        text = self._text(block.text.source, block.begin - before, block.end + LONGEST_LINE)
        most = int(self._kernels.ends_of_lines(text)) + 1
        floats, wholes = np.empty((len(self._floats), most)), np.empty((len(self._wholes), most), np.int32)
        flags, status = np.empty((len(self._flags), most), bool), np.empty(most, np.uint8)
        lines, gaps, odd = (np.empty(shape, np.int32) for shape in (most, (most, 2), (most, 3)))
        rows, odds, gap_count, line_count = self._kernels.read_lines(
            text, block.end - block.begin + before, not before, self._marked, self._kinds, self._statuses,
            floats, wholes, flags, status, lines, odd, gaps,
        )  # fmt: skip
        columns = dict(zip(self._floats, floats[:, :rows], strict=True))
        columns |= dict(zip(self._wholes, wholes[:, :rows], strict=True))
        columns |= dict(zip(self._flags, flags[:, :rows], strict=True))
        columns |= {"episode_status": status[:rows]} if self._has_status else {}
        left = [(int(line), _words_of(text[begin:end])) for begin, end, line in odd[:odds]]
        between = b"".join(text[begin:end].tobytes() for begin, end in gaps[:gap_count])
        return _Found(block, columns | {"line": lines[:rows]}, left, between, line_count)

    def _text(self, source: Source, begin: int, end: int) -> Array:
        """Return these bytes of a file, as far as it goes, with zeros behind."""
        zeros, before = self._kernels.ZEROS_BEHIND, self._bytes_before
        if not hasattr(self._thread, "text"):
            self._thread.text = np.zeros(before + BLOCK_BYTES + LONGEST_LINE + zeros + 1, np.uint8)
        text = self._thread.text[before : before + min(end, source.size) - begin + zeros]
        with source.open() as file:
            file.seek(begin)
            length = file.readinto(memoryview(text)[:-zeros])
        text[length:] = 0
        return text[: length + zeros]


def _words_of(text: Array) -> str:
    """Return a row as text, without what a log wrote behind a tab."""
    return text.tobytes().decode("utf-8", errors="replace").split("\t", 1)[0].rstrip("\r\n\0")
