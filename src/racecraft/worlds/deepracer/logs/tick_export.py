"""The table of ticks as a file for strangers: CSV or Parquet. Begin with `write_csv` and `write_parquet`."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.formats.atomic import atomic_file, write_atomic

if TYPE_CHECKING:
    import polars as pl

FORMAT, VERSION = "racecraft ticks", 1


def write_csv(path: str | Path, ticks: pl.DataFrame) -> Path:
    """Write the ticks as CSV, named columns first, in the units that the names say.

    Raises:
        OutputFileError: The file cannot be written.
    """
    with atomic_file(path) as part, open(part, "wb") as file:
        ticks.write_csv(file)
    return Path(path)


def write_parquet(path: str | Path, ticks: pl.DataFrame) -> Path:
    """Write the ticks as Parquet, with the name and version of the format.

    Raises:
        OutputFileError: The file cannot be written.
    """
    whole = BytesIO()
    ticks.write_parquet(whole, metadata={"format": FORMAT, "version": str(VERSION)})
    write_atomic(path, whole.getvalue())
    return Path(path)
