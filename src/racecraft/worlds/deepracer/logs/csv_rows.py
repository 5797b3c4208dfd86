"""Rows of simulation traces out of comma-separated text. Begin with `read_rows`.

Polars parses many files at once. Rows with a value it cannot take, or with a wrong number of values, go to the tolerant
parser (`tolerant_rows.py`), which takes them or names what is wrong.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.files.sim_trace import NAMES
from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.tolerant_rows import action_number, csv_type, is_valid, read_tolerantly, value_of

if TYPE_CHECKING:
    import polars as pl

CHUNK_BYTES = 32 << 20
"""Text that is parsed at a time."""
_EXTRA = "extra"


OddRows = tuple["Text", list[tuple[int, str]]]
"""Line number and words of rows of a text that are not plainly valid."""


@dataclass(frozen=True)
class Text:
    """Rows of one file."""

    file: int
    """Index of the file among the table's files."""
    name: str
    """The file, as the user would name it."""
    header: tuple[str, ...]
    """AWS's names of the columns in the order of the fields; other names are passed over."""
    rows: bytes
    """One row a line, each with its end of line."""
    lines: Array
    """int32, the line number of each row, counted from 1."""


def read_rows(
    texts: Iterable[Text], versions: Mapping[int, tuple[str, ...]] | None = None
) -> tuple[pl.DataFrame, list[Damage]]:
    """Read the rows of texts.

    Args:
        texts: In order; several may belong to one file.
        versions: Number of values → header of rows with so many, where texts mix them.

    Returns:
        AWS's columns in AWS's units and order, then `file` and `line`; continuous actions are -1. And the damaged rows.
    """
    import polars as pl

    frames: list[pl.DataFrame] = []
    odd: dict[tuple[int, str, tuple[str, ...]], list[tuple[int, str]]] = {}
    for chunk in _chunks(texts):
        frame, others = _parse(chunk)
        frames.append(frame)
        for text, rows in others:
            odd.setdefault((text.file, text.name, text.header), []).extend(rows)
    tolerated, damage = _read_odd(odd, versions or {})
    some = [frame for frame in (*frames, *tolerated) if frame.height]
    if not some:
        return pl.DataFrame(), damage
    whole = pl.concat(some, how="diagonal")
    whole = whole.select(name for name in (*NAMES, "file", "line") if name in whole.columns)
    return (whole.sort("file", "line") if any(frame.height for frame in tolerated) else whole), damage


def _chunks(texts: Iterable[Text]) -> Iterator[list[Text]]:
    """Put neighbours with the same header together, up to CHUNK_BYTES."""
    chunk: list[Text] = []
    size = 0
    for text in texts:
        if chunk and (text.header != chunk[0].header or size + len(text.rows) > CHUNK_BYTES):
            yield chunk
            chunk, size = [], 0
        chunk.append(text)
        size += len(text.rows)
    if chunk:
        yield chunk


def _parse(chunk: Sequence[Text]) -> tuple[pl.DataFrame, list[OddRows]]:
    """Parse texts of one header.

    Returns:
        The valid rows; and of each text line and words of the others, which lack a value or have one too many.
    """
    import polars as pl

    header = chunk[0].header
    fields = [*map(str, range(len(header))), _EXTRA]
    data = b"".join([",".join(fields).encode(), b"\n", *(text.rows for text in chunk)])
    types = dict(zip(fields, [*map(csv_type, header), pl.String()], strict=True))
    actions = [field for field, name in zip(fields, header, strict=False) if name == "action" and b"[" in data]
    cells = pl.read_csv(
        data, schema=types | dict.fromkeys(actions, pl.String()), quote_char=None, ignore_errors=True,
        truncate_ragged_lines=True, encoding="utf8-lossy",
    ).with_columns(action_number(pl.col(field)).alias(field) for field in actions)  # fmt: skip
    known = {name: pl.col(field) for field, name in zip(fields, header, strict=False) if name in NAMES}
    valid = pl.all_horizontal(is_valid(cell, name) for name, cell in known.items()).fill_null(False)
    whole = pl.col(fields[-2]).is_not_null() & pl.col(_EXTRA).is_null()
    odd = cells.select(odd=~(valid & whole))["odd"]
    others = _rows_of(chunk, odd.to_numpy())
    if _has_hidden_cells(data, len(header), odd, others):
        odd = odd | True
        others = _rows_of(chunk, odd.to_numpy())
    counts = [len(text.lines) for text in chunk]
    placed = cells.select(
        *(value_of(cell, name).alias(name) for name, cell in known.items()),
        pl.Series("file", np.repeat(np.array([text.file for text in chunk], np.uint32), counts)),
        pl.Series("line", np.concatenate([text.lines for text in chunk])),
    )
    return (placed.filter(~odd) if others else placed), others


def _has_hidden_cells(data: bytes, columns: int, odd: pl.Series, others: list[OddRows]) -> bool:
    """Tell whether a row not in `odd` has cells behind its last column; Polars drops them where the first is empty."""
    commas = int(np.count_nonzero(np.frombuffer(data, np.uint8) == ord(",")))
    separators = sum(row.count(",") for _, rows in others for _, row in rows)
    return commas != columns + (~odd).sum() * (columns - 1) + separators


def _rows_of(chunk: Sequence[Text], odd: Array) -> list[OddRows]:
    """Return line and words of the rows that `odd` (bool, one for each row of the chunk) marks, text by text."""
    found = []
    begin = 0
    for text in chunk:
        picked = np.flatnonzero(odd[begin : begin + len(text.lines)])
        if len(picked):
            rows = text.rows.split(b"\n")
            words = [rows[k].decode("utf-8", errors="replace") for k in picked]
            found.append((text, list(zip(text.lines[picked].tolist(), words, strict=True))))
        begin += len(text.lines)
    return found


def _read_odd(
    odd: Mapping[tuple[int, str, tuple[str, ...]], Sequence[tuple[int, str]]], versions: Mapping[int, tuple[str, ...]]
) -> tuple[list[pl.DataFrame], list[Damage]]:
    """Read rows tolerantly, file by file, each by the version that has as many values as it."""
    import polars as pl

    frames: list[pl.DataFrame] = []
    damage: list[Damage] = []
    for (file, name, header), rows in odd.items():
        by_header: dict[tuple[str, ...], list[tuple[int, str]]] = {header: []}
        for line, row in rows:
            by_header.setdefault(versions.get(row.count(",") + 1, header), []).append((line, row))
        for one, its_rows in by_header.items():
            frame, wrong = read_tolerantly(name, one, its_rows)
            frames.append(frame.with_columns(pl.lit(file, pl.UInt32).alias("file")))
            damage += wrong
    return frames, damage
