"""The ticks as far as they were asked for. Begin with `Asked`.

A question about two columns of a million rows need not wait for twenty-seven. The first question reads the columns that
it names; a second one that needs more reads them all, so that nobody who goes on asking waits more than twice.
"""

from __future__ import annotations

import threading
from collections.abc import Collection, Iterator, Sequence
from typing import TYPE_CHECKING

from racecraft.worlds.deepracer.logs.columns import TICK_COLUMNS, schema
from racecraft.worlds.deepracer.logs.errors import Damage
from racecraft.worlds.deepracer.logs.sources import Source
from racecraft.worlds.deepracer.logs.ticks import Said, read_ticks

if TYPE_CHECKING:
    import polars as pl


class Asked:
    """The table of ticks of some files, read when it is asked for; any number of threads may ask.

    Args:
        sources: The files, in order.
        phase: What rows belong to whose path does not tell; None: the rows tell.
    """

    def __init__(self, sources: Sequence[Source], phase: str | None) -> None:
        self._sources, self._phase = sources, phase
        self._lock = threading.RLock()  # Polars may answer a second question on the thread that waits for the first
        self._read: tuple[pl.DataFrame, list[Damage], Said] | None = None

    def lazy(self) -> pl.LazyFrame:
        """Return the table; a question to it names its columns by itself."""
        from polars.io.plugins import register_io_source

        return register_io_source(self._answer, schema=schema(TICK_COLUMNS))

    def columns(self, names: Collection[str] | None = None) -> pl.DataFrame:
        """Return some columns of every row, in the order of TICK_COLUMNS; None: all."""
        with self._lock:
            wanted = set(schema(TICK_COLUMNS) if names is None else names)
            if self._read is None or not wanted <= set(self._read[0].columns):
                everything = names is None or self._read is not None
                self._read = read_ticks(self._sources, self._phase, None if everything else wanted)
            frame = self._read[0]
            return frame.select(name for name in frame.columns if name in wanted)

    def beside(self) -> tuple[list[Damage], Said]:
        """Return what was damaged, and what logs say beside the ticks; the same whichever columns were read."""
        with self._lock:
            if self._read is None:
                self.columns(())
            assert self._read is not None
            return self._read[1], self._read[2]

    def _answer(
        self, names: list[str] | None, keep: pl.Expr | None, rows: int | None, _: int | None
    ) -> Iterator[pl.DataFrame]:
        """Answer a question: these columns, of these many rows, those for which `keep` holds."""
        frame = self.columns(names)
        frame = frame if names is None else frame.select(names)
        frame = frame if rows is None else frame.head(rows)
        yield frame if keep is None else frame.filter(keep)
