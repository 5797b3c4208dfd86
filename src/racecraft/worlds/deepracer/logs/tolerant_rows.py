"""Damaged rows: which line, which value, why; valid rows among them are kept. Begin with `read_tolerantly`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from racecraft.formats.episodes import STATUSES
from racecraft.worlds.deepracer.files.sim_trace import CONTINUOUS_ACTION, NAMES, TRACE_COLUMNS
from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.limits import HIGHEST, HIGHEST_WHOLE

if TYPE_CHECKING:
    import polars as pl

MAX_NAMED = 20
"""Damaged rows of a file that are named one by one; of the others only how many there are."""
_TYPES = {column.name: column.dtype for column in TRACE_COLUMNS}


def read_tolerantly(
    name: str, header: Sequence[str], rows: Sequence[tuple[int, str]]
) -> tuple[pl.DataFrame, list[Damage]]:
    """Read rows of one file.

    Args:
        name: The file, as the user would name it.
        header: AWS's names of the columns in the file's order.
        rows: (line number, comma-separated values) of each.

    Returns:
        AWS's columns of the valid rows and `line`; and what was wrong with the others.
    """
    import polars as pl

    texts = pl.DataFrame(rows, schema={"line": pl.Int32, "text": pl.String}, orient="row")
    texts = texts.with_columns(pl.col("text").str.strip_chars_end("\r\t "))
    texts = texts.filter(pl.col("text") != "").with_columns(pl.col("text").str.split(",").alias("cells"))
    count = pl.col("cells").list.len()
    what = f"{{}} values where {len(header)} are expected"
    short = texts.filter(count != len(header)).select("line", count)
    wrong = [(line, what.format(count)) for line, count in short.iter_rows()]
    places = {name: k for k, name in enumerate(header) if name in NAMES}
    cells = texts.filter(count == len(header)).select(
        "line", *(pl.col("cells").list.get(k).alias(name) for name, k in places.items())
    )
    parsed = cells.select("line", *map(_parsed, places))
    valid = parsed.select(is_valid(pl.col(name), name).fill_null(False).alias(name) for name in places)
    whole = valid.select(whole=pl.all_horizontal(pl.all()))["whole"]
    wrong += list(_wrong_cells(cells.filter(~whole), valid.filter(~whole)))
    read = parsed.filter(whole).select("line", *(value_of(pl.col(name), name) for name in places))
    wrong.sort()
    damage = [Damage(name, line, f"{what}; the row was passed over") for line, what in wrong[:MAX_NAMED]]
    if len(wrong) > MAX_NAMED:
        damage.append(Damage(name, None, f"{len(wrong) - MAX_NAMED} more rows were passed over"))
    return read, damage


def csv_type(name: str) -> pl.DataType:
    """Return the Polars type as which a column is parsed, before `value_of`; text where the name is not known."""
    import polars as pl

    kind = _TYPES.get(name, "str")
    return {"bool": pl.Boolean(), "str": pl.String()}.get(kind, pl.Float64())


def action_number(cell: pl.Expr) -> pl.Expr:
    """Return an action's number out of its text; a continuous one, an angle and a speed in brackets, is -1."""
    import polars as pl

    continuous = cell.str.starts_with("[") & cell.str.ends_with("]")
    return pl.when(continuous).then(CONTINUOUS_ACTION).otherwise(cell.cast(pl.Float64, strict=False))


def value_of(cell: pl.Expr, name: str) -> pl.Expr:
    """Return the value of a cell that was parsed as `csv_type`; of a row that `is_valid`."""
    import polars as pl

    if _TYPES[name] == "str":
        return cell.cast(pl.Enum(STATUSES), strict=False)
    return cell.cast(pl.Int32, strict=False) if _is_complete(name) else cell


def is_valid(cell: pl.Expr, name: str) -> pl.Expr:
    """Tell whether the column can have the value of a cell that was parsed as `csv_type`; null or False where not."""
    if _TYPES[name] in ("bool", "str"):
        return value_of(cell, name).is_not_null()
    return (cell % 1 == 0) & (cell.abs() < HIGHEST_WHOLE) if _is_complete(name) else cell.abs() < HIGHEST


def _is_complete(name: str) -> bool:
    return _TYPES[name] == "int64" or name == "steps"


def _parsed(name: str) -> pl.Expr:
    """Return a column of text as `csv_type`; spreadsheets write TRUE."""
    import polars as pl

    cell, kind = pl.col(name).str.strip_chars(), csv_type(name)
    if kind == pl.Boolean:
        word = cell.str.to_lowercase()
        return pl.when(word == "true").then(True).when(word == "false").then(False).alias(name)
    return action_number(cell).alias(name) if name == "action" else cell.cast(kind, strict=False)


def _wrong_cells(cells: pl.DataFrame, valid: pl.DataFrame) -> Iterator[tuple[int, str]]:
    """Yield line and first wrong value of rows that have one."""
    for text, taken in zip(cells.iter_rows(named=True), valid.iter_rows(named=True), strict=True):
        name = next(name for name, is_taken in taken.items() if not is_taken)
        yield text["line"], f"{name} is {text[name]!r}"
