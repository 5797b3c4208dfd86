"""Rows of simulation traces, file by file. Begin with `read_traces`; files with the same header are read together."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

from racecraft.worlds.deepracer.files.sim_trace import NAMES, TRACE_COLUMNS
from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.rows_of_text import read_rows
from racecraft.worlds.deepracer.logs.sources import OtherHeadError, Source
from racecraft.worlds.deepracer.logs.spreadsheets import as_plain_text
from racecraft.worlds.deepracer.logs.texts import Text

if TYPE_CHECKING:
    import polars as pl

_FOLDED = {name.casefold(): name for name in NAMES}
_REQUIRED = [column.name for column in TRACE_COLUMNS if column.required]
_MOST_HEADER_BYTES = 4096


def read_traces(
    sources: Sequence[tuple[int, Source]], wanted: Collection[str] | None = None
) -> tuple[pl.DataFrame, list[Damage]]:
    """Read traces, given with their index among the table's files; `wanted` as in `read_rows`.

    Returns:
        AWS's columns in our units and `file`, `line`; and what was damaged.
    """
    try:
        return _read_alike(sources, wanted)
    except (OtherHeadError, OSError):  # whose header differs, or who cannot be read, is found file by file
        return _read_in_turn(sources, wanted)


def _read_alike(
    sources: Sequence[tuple[int, Source]], wanted: Collection[str] | None
) -> tuple[pl.DataFrame, list[Damage]]:
    """Read traces that all have the first one's header, and open each but once.

    Raises:
        OtherHeadError: They do not, or there is something to tell of the first one.
        OSError: One cannot be read.
    """
    damage: list[Damage] = []
    header, first = _headed(sources[0], damage)
    head = _first_line(first.source)
    texts = [Text(place, source, begin=first.begin, line=first.line, head=head) for place, source in sources]
    is_sound = isinstance(header, tuple) and not damage and not any(name not in header for name in _REQUIRED)
    if not is_sound or _first_line(sources[-1][1]) != head:
        raise OtherHeadError
    rows = read_rows(header, texts, wanted=wanted)
    return rows.frame, rows.damage


def _read_in_turn(
    sources: Sequence[tuple[int, Source]], wanted: Collection[str] | None
) -> tuple[pl.DataFrame, list[Damage]]:
    """Read traces as the header of each says."""
    import polars as pl

    frames: list[pl.DataFrame] = []
    damage: list[Damage] = []
    headed = (_headed(pair, damage) for pair in sources)
    for header, group in itertools.groupby(headed, key=lambda pair: pair[0]):
        texts = [text for _, text in group]
        if isinstance(header, str):
            damage += [Damage(text.source.name, None, header) for text in texts]
            continue
        lacking = [name for name in _REQUIRED if name not in header]
        if lacking:
            damage += [Damage(text.source.name, 1, f"no column {', '.join(lacking)}; left out") for text in texts]
        else:
            rows = read_rows(header, texts, wanted=wanted)
            frames.append(rows.frame)
            damage += rows.damage
    return (pl.concat(frames, how="diagonal") if frames else pl.DataFrame()), damage


def _headed(pair: tuple[int, Source], damage: list[Damage]) -> tuple[tuple[str, ...] | str, Text]:
    """Return our names of a trace's columns, its own for those that we do not know; and the text below them.

    Of a file without columns it is told what is wrong with it instead of them; `damage` is told of one that a
    spreadsheet saved.
    """
    place, source = pair
    try:
        line = _first_line(source)
        source, told = as_plain_text(source, line)
        if told:
            damage.append(Damage(source.name, None, told))
            line = _first_line(source)
    except OSError as error:
        return f"cannot be read ({error.strerror}); left out", Text(place, source)
    if not line.strip():
        return "the file is empty", Text(place, source)
    return _names_of(line), Text(place, source, begin=len(line), line=2)


@lru_cache
def _names_of(line: bytes) -> tuple[str, ...]:
    """Return our names of the columns that a first line names; a training's files all begin with the same one."""
    words = line.decode("utf-8-sig", errors="replace").rstrip("\r\n").split(",")
    return tuple(_FOLDED.get(word.strip().casefold(), f"__{k}" if word else "") for k, word in enumerate(words))


def _first_line(source: Source) -> bytes:
    head = bytearray(_MOST_HEADER_BYTES)
    count = source.read_into(memoryview(head))
    return bytes(head[: head.find(b"\n", 0, count) + 1 or count])
