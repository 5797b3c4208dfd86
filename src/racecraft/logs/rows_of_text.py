"""Rows of simulation traces out of text, from CSV files and logs alike. Begin with `read_rows`.

Text is cut into blocks of some megabytes, and the compiled reader (`kernels/rows.py`) takes the blocks on every core.
It leaves out what is not plainly sound; `careful.py` looks at those rows one by one, takes what can be taken and names
the rest. So a damaged row costs itself and no more. Little text is read carefully as a whole: that is sooner done than
compiled code is loaded.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
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
SPARE = 1.05
"""Room for so many times the rows that are to be expected."""
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

    @cached_property
    def size(self) -> int:
        """Bytes of the file, asked once."""
        return self.source.size


@dataclass(frozen=True)
class Rows:
    """What texts hold."""

    frame: pl.DataFrame
    """AWS's columns in AWS's units and order, then `file` and `line`; continuous actions are -1."""
    damage: list[Damage]
    between: bytes
    """The other lines of logs."""


def read_rows(
    header: Sequence[str],
    texts: Sequence[Text],
    marked: bool = False,
    wanted: Collection[str] | None = None,
    versions: Mapping[int, Sequence[str]] | None = None,
) -> Rows:
    """Read the rows of texts.

    Args:
        header: AWS's names of the columns in the order of the fields; other names are passed over.
        texts: Files whose rows have these fields, in order.
        marked: Whether rows stand behind SIM_TRACE_LOG: among other lines; else every line is a row.
        wanted: AWS's names of the columns that are asked for, None: all; others may be left out where that saves time.
            Which rows are sound does not depend on it.
        versions: How many values other versions of rows have → their columns, where texts mix them.
    """
    versions = versions or {}
    if sum(text.size for text in texts) <= LITTLE_BYTES:
        return _joined(NAMES, [_carefully(header, text, marked, versions) for text in texts])
    stretches = list(_stretches(block for text in texts for block in _blocks(text)))
    reader, table = _Reader(header, marked, wanted), _Table(sum(text.size for text in texts))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = list(itertools.chain.from_iterable(map(table.take, pool.map(reader.read, stretches))))
    sound = Rows(table.frame(), [], b"".join(block.between for block in found))
    odd = itertools.groupby((block for block in found if block.odd), key=lambda block: block.block.text)
    unasked = set(header) - set(sound.frame.columns)
    asked = [name for name in NAMES if name not in unasked]
    rows = _joined(asked, [sound, *(_odd_rows(header, text, blocks, versions) for text, blocks in odd)])
    more = rows.frame.height > sound.frame.height
    return replace(rows, frame=rows.frame.sort("file", "line")) if more else rows


def _carefully(header: Sequence[str], text: Text, marked: bool, versions: Mapping[int, Sequence[str]]) -> Rows:
    """Read a text without compiled code."""
    data = text.source.read()[text.begin :]
    lines = data.decode("utf-8", errors="replace").split("\n")
    numbers: Sequence[int] = range(text.line, text.line + len(lines))
    between = b""
    if marked:
        numbers = [number for number, line in zip(numbers, lines, strict=True) if MARK in line]
        between = "\n".join(line for line in lines if MARK not in line).encode()
        lines = [line.split(MARK, 1)[1].split("\t", 1)[0] for line in lines if MARK in line]
    return Rows(*_every_version(header, text, numbers, lines, versions), between)


def _every_version(
    header: Sequence[str],
    text: Text,
    numbers: Sequence[int],
    lines: Sequence[str],
    versions: Mapping[int, Sequence[str]],
) -> tuple[pl.DataFrame, list[Damage]]:
    """Read rows of one text carefully, each by the version that has as many values as it."""
    import polars as pl

    usual: dict[int, str] = {}
    others: dict[int, dict[int, str]] = {}
    for number, line in zip(numbers, lines, strict=True):
        count = line.count(",") + 1 if versions else len(header)
        known = count != len(header) and count in versions
        (others.setdefault(count, {}) if known else usual)[number] = line
    groups = [(header, usual), *((versions[count], rows) for count, rows in others.items())]
    read = [read_carefully(text.source.name, names, list(rows), list(rows.values())) for names, rows in groups]
    frame = pl.concat([frame for frame, _ in read], how="diagonal") if others else read[0][0]
    damage = [one for _, more in read for one in more]
    return frame.sort("line").with_columns(pl.lit(text.place, pl.UInt32).alias("file")), damage


def _joined(names: Sequence[str], pieces: Sequence[Rows]) -> Rows:
    """Put these columns, `file` and `line` of texts and blocks one below the other."""
    import polars as pl

    frames = [
        piece.frame.select(name for name in (*names, "file", "line") if name in piece.frame.columns)
        for piece in pieces
        if piece.frame.height
    ]
    damage = list(itertools.chain.from_iterable(piece.damage for piece in pieces))
    frame = pl.concat(frames, how="diagonal", rechunk=True) if frames else pl.DataFrame()
    return Rows(frame, damage, b"".join(piece.between for piece in pieces))


@dataclass(frozen=True)
class _Block:
    """The lines of a text that begin from `begin` up to before `end`."""

    text: Text
    begin: int
    end: int


def _blocks(text: Text) -> list[_Block]:
    cuts = [*range(text.begin, text.size, BLOCK_BYTES), text.size]
    return [_Block(text, begin, end) for begin, end in itertools.pairwise(cuts)]


def _stretches(blocks: Iterable[_Block]) -> Iterator[list[_Block]]:
    """Yield blocks by as many as have about BLOCK_BYTES together: what one thread reads at a time."""
    stretch: list[_Block] = []
    size = 0
    for block in blocks:
        stretch.append(block)
        size += block.end - block.begin
        if size >= BLOCK_BYTES:
            yield stretch
            stretch, size = [], 0
    if stretch:
        yield stretch


@dataclass
class _Found:
    """What the compiled reader found in a block."""

    block: _Block
    rows: int
    """How many sound rows."""
    odd: list[tuple[int, str]]
    """Line and text of the rows that are not plainly sound."""
    between: bytes
    lines: int
    """How many lines there are."""
    first_line: int = 0
    """Number of the first line; `odd` counts from it."""


@dataclass(frozen=True)
class _Stretch:
    """What the compiled reader found in several blocks that follow each other."""

    found: list[_Found]
    columns: dict[str, Array]
    """Those of the sound rows, block by block, and `line`, which each block counts from its own first line."""


class _Table:
    """The sound rows of all blocks; each stretch is laid to its place while others are still read.

    Args:
        size: Bytes of all texts.
    """

    def __init__(self, size: int) -> None:
        self._size, self._seen, self._rows = size, 0, 0
        self._columns: dict[str, Array] = {}
        self._files: list[tuple[int, int]] = []
        self._line = 0

    def take(self, stretch: _Stretch) -> list[_Found]:
        """Add the stretch that follows; return what was found in its blocks, their lines counted on."""
        begin = self._rows
        for piece in stretch.found:
            text = piece.block.text
            self._line = piece.first_line = text.line if piece.block.begin == text.begin else self._line
            stretch.columns["line"][self._rows - begin :][: piece.rows] += self._line
            self._line += piece.lines
            self._rows += piece.rows
            self._seen += piece.block.end - piece.block.begin
            self._files.append((text.place, piece.rows))
        self._make_room(stretch.columns)
        for name, values in stretch.columns.items():
            self._columns[name][begin : self._rows] = values
        return stretch.found

    def _make_room(self, like: Mapping[str, Array]) -> None:
        """Have room for all rows that are there; for those to come, too, if they are as long as these."""
        if self._columns and self._rows <= len(self._columns["line"]):
            return
        room = max(self._rows, int(self._rows * self._size / max(self._seen, 1) * SPARE) + 1)
        for name, values in like.items():
            longer = np.empty(room, values.dtype)
            before = self._columns.get(name, values[:0])
            longer[: len(before)] = before
            self._columns[name] = longer

    def frame(self) -> pl.DataFrame:
        """Return the rows, with `file`; its columns lie where they were laid."""
        import polars as pl

        def column(name: str) -> pl.Series:
            values = self._columns[name][: self._rows]
            if name == "episode_status":
                return pl.Series(name, STATUSES, pl.Enum(STATUSES)).gather(values)
            return pl.Series(name, values)

        places, counts = zip(*self._files, strict=True)
        files = np.repeat(np.array(places, np.uint32), counts)
        return pl.DataFrame([*map(column, self._columns), pl.Series("file", files)])


def _odd_rows(
    header: Sequence[str], text: Text, blocks: Iterable[_Found], versions: Mapping[int, Sequence[str]]
) -> Rows:
    """Read the rows of a text carefully that are not plainly sound."""
    odd = [(block.first_line + line, row) for block in blocks for line, row in block.odd]
    return Rows(*_every_version(header, text, [line for line, _ in odd], [row for _, row in odd], versions), b"")


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
        self._marked = marked
        self._kinds = np.array([kinds.get(name, rows.SKIPPED) for name in header])
        self._floats = [name for name in header if kinds.get(name) == rows.FLOAT]
        self._wholes = [name for name in header if kinds.get(name) in (rows.WHOLE, rows.ACTION)]
        self._flags = [name for name in header if kinds.get(name) == rows.FLAG]
        self._has_status = "episode_status" in header
        self._statuses = np.array(
            [[rows.word(word[:8]), rows.word(word[8:]), np.uint64(len(word))] for word in STATUSES]
        )

    def read(self, blocks: Sequence[_Block]) -> _Stretch:
        """Read blocks that follow each other, BLOCK_BYTES each at most."""
        texts = [self._text(block) for block in blocks]
        room = sum(int(self._kernels.ends_of_lines(text)) + 1 for text in texts)
        floats, wholes = np.empty((len(self._floats), room)), np.empty((len(self._wholes), room), np.int32)
        flags, status = np.empty((len(self._flags), room), bool), np.empty(room, np.uint8)
        lines, gaps, odd = (np.empty(shape, np.int32) for shape in (room, (room, 2), (room, 3)))
        found, rows = [], 0
        for block, text in zip(blocks, texts, strict=True):
            before = _bytes_before(block)
            count, odds, gap_count, line_count = self._kernels.read_lines(
                text, block.end - block.begin + before, not before, self._marked, self._kinds, self._statuses,
                rows, floats, wholes, flags, status, lines, odd, gaps,
            )  # fmt: skip
            left = [(int(line), _words_of(text[begin:end])) for begin, end, line in odd[:odds]]
            between = b"".join(text[begin:end].tobytes() for begin, end in gaps[:gap_count])
            found.append(_Found(block, count, left, between, line_count))
            rows += count
        columns = dict(zip(self._floats, floats[:, :rows], strict=True))
        columns |= dict(zip(self._wholes, wholes[:, :rows], strict=True))
        columns |= dict(zip(self._flags, flags[:, :rows], strict=True))
        columns |= {"episode_status": status[:rows]} if self._has_status else {}
        return _Stretch(found, columns | {"line": lines[:rows]})

    def _text(self, block: _Block) -> Array:
        """Return the bytes of a block and LONGEST_LINE more, as far as the file goes, with zeros behind."""
        begin = block.begin - _bytes_before(block)
        length = min(block.end + LONGEST_LINE, block.text.size) - begin
        bytes_of = np.empty(self._bytes_before + length + self._kernels.ZEROS_BEHIND, np.uint8)
        text = bytes_of[self._bytes_before :]
        length = block.text.source.read_into(text[:length].data, begin)
        text[length:] = 0
        return text[: length + self._kernels.ZEROS_BEHIND]


def _bytes_before(block: _Block) -> int:
    """Return how many bytes before a block are read with it: where a line begins with it, the byte before it tells."""
    return int(block.begin > block.text.begin)


def _words_of(text: Array) -> str:
    """Return a row as text, without what a log wrote behind a tab."""
    return text.tobytes().decode("utf-8", errors="replace").split("\t", 1)[0].rstrip("\r\n\0")
