"""The table of ticks, read at its first query. Begin with `LazyTicks`."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from racecraft.worlds.deepracer.logs.columns import TICK_COLUMNS, schema
from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.sources import Source
from racecraft.worlds.deepracer.logs.ticks import RawRow, read_ticks

if TYPE_CHECKING:
    import polars as pl


class LazyTicks:
    """The table of ticks of some files, read once; any number of threads may query it.

    Args:
        sources: The files, in order.
        phase: What rows belong to whose path does not tell; None: the rows tell.
    """

    def __init__(self, sources: Sequence[Source], phase: str | None) -> None:
        self._sources, self._phase = sources, phase
        self._lock = threading.RLock()  # Polars may run a second query on the thread that waits for the first
        self._result: tuple[pl.DataFrame, list[Damage], RawRow] | None = None

    def lazy(self) -> pl.LazyFrame:
        """Return the table; nothing is read before it is queried."""
        from polars.io.plugins import register_io_source

        return register_io_source(self._batches, schema=schema(TICK_COLUMNS))

    def read(self) -> tuple[pl.DataFrame, list[Damage], RawRow]:
        """Return every tick, what was damaged, and what logs say beside the ticks."""
        with self._lock:
            if self._result is None:
                self._result = read_ticks(self._sources, self._phase)
            return self._result

    def _batches(
        self, names: list[str] | None, predicate: pl.Expr | None, rows: int | None, _: int | None
    ) -> Iterator[pl.DataFrame]:
        """Yield these columns of the first `rows` rows, those for which the predicate holds."""
        frame = self.read()[0]
        frame = frame if names is None else frame.select(names)
        frame = frame if rows is None else frame.head(rows)
        yield frame if predicate is None else frame.filter(predicate)
