"""Rows of simulation traces, file by file. Begin with `read_traces`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from racecraft.worlds.deepracer.files.sim_trace import NAMES, TRACE_COLUMNS
from racecraft.worlds.deepracer.logs.csv_rows import Text, read_rows
from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.sources import Source
from racecraft.worlds.deepracer.logs.spreadsheets import as_plain_text

if TYPE_CHECKING:
    import polars as pl

_FOLDED = {name.casefold(): name for name in NAMES}
_REQUIRED = [column.name for column in TRACE_COLUMNS if column.required]


def read_traces(sources: Sequence[tuple[int, Source]]) -> tuple[pl.DataFrame, list[Damage]]:
    """Read traces, given with their index among the table's files.

    Returns:
        AWS's columns in AWS's units and `file`, `line`; and what was damaged.
    """
    damage: list[Damage] = []
    frame, wrong = read_rows(_texts(sources, damage))
    return frame, damage + wrong


def _texts(sources: Sequence[tuple[int, Source]], damage: list[Damage]) -> Iterator[Text]:
    """Yield the rows of each file; `damage` is told of files that are left out, or that a spreadsheet saved."""
    for place, source in sources:
        try:
            data = source.read()
            source, note = as_plain_text(source, _first_line(data))
            if note:
                damage.append(Damage(source.name, None, note))
                data = source.read()
        except OSError as error:
            damage.append(Damage(source.name, None, f"cannot be read ({error.strerror}); left out"))
            continue
        head = _first_line(data)
        if not head.strip():
            damage.append(Damage(source.name, None, "the file is empty"))
            continue
        header = _names_of(head)
        lacking = [name for name in _REQUIRED if name not in header]
        if lacking:
            damage.append(Damage(source.name, 1, f"no column {', '.join(lacking)}; left out"))
            continue
        rows = data[len(head) :]
        rows = rows if rows.endswith(b"\n") or not rows else rows + b"\n"
        yield Text(place, source.name, header, rows, np.arange(2, 2 + rows.count(b"\n"), dtype=np.int32))


@lru_cache
def _names_of(head: bytes) -> tuple[str, ...]:
    """Return our names of the columns that a first line names; a training's files all begin with the same one."""
    words = head.decode("utf-8-sig", errors="replace").rstrip("\r\n").split(",")
    return tuple(_FOLDED.get(word.strip().casefold(), f"__{k}" if word else "") for k, word in enumerate(words))


def _first_line(data: bytes) -> bytes:
    return data[: data.find(b"\n") + 1 or len(data)]
