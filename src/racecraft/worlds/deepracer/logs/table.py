"""What was read: one lazy table of ticks, one of metrics, what was damaged. Begin with `Logs`; `read.py` makes it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from racecraft.contract.errors import MissingExtraError
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.logs.about import facts_of
from racecraft.worlds.deepracer.logs.clocks import jumps
from racecraft.worlds.deepracer.logs.errors import Damage, LogError
from racecraft.worlds.deepracer.logs.lazy_ticks import LazyTicks
from racecraft.worlds.deepracer.logs.log_rows import rows_behind
from racecraft.worlds.deepracer.logs.metric_rows import read_metrics
from racecraft.worlds.deepracer.logs.sources import ABOUT, EXPECTED, LOG, METRICS, Source
from racecraft.worlds.deepracer.logs.ticks import OURS, RawRow

if TYPE_CHECKING:
    import pandas as pd  # type: ignore[import-untyped]
    import polars as pl

SAME_PLACE_M = 0.001
"""Logs write a place to 0.1 mm, traces more precisely."""


@dataclass(frozen=True, eq=False)
class Logs:
    """Logs that were found; a file is opened when something in it is asked for the first time.

    Args:
        sources: The files, in the order in which they were written.
        phase: What rows belong to whose path does not tell; None: the rows tell.
    """

    sources: tuple[Source, ...]
    phase: str | None = None
    is_one_training: bool = False
    """Whether the rounds go on from each other, as several paths that were named in order; else a folder's models."""

    def models(self) -> dict[str, tuple[int, ...]]:
        """Return the rounds of each model: by its folder, or all together under "" where they are one training."""
        rounds: dict[str, set[int]] = {}
        for source in self.sources:
            rounds.setdefault("" if self.is_one_training else source.root, set()).add(source.round)
        return {root: tuple(sorted(numbers)) for root, numbers in rounds.items()}

    def of_model(self, root: str) -> Logs:
        """Return the logs of one of `models` alone, as if only its folder had been read.

        Where there are others, its files are read anew.
        """
        models = self.models()
        if len(models) == 1:
            return self
        rounds = models[root]
        own = (source for source in self.sources if source.round in rounds)
        return replace(
            self, sources=tuple(source.placed(1 + rounds.index(source.round), source.stream) for source in own)
        )

    def about_rounds(self, rounds: Collection[int]) -> RawRow:
        """Return what the files of some rounds say beside the ticks, as `about` does of all."""
        metadata: RawRow = {}
        for source in self.sources:
            if source.round in rounds and source.kind in (ABOUT, LOG):
                metadata = {**facts_of(source), **metadata}
        return metadata

    @property
    def ticks(self) -> pl.LazyFrame:
        """One row a tick: TICK_COLUMNS, in SI units, radians and shares; files are read at the first query."""
        return self._lazy_ticks.lazy()

    @property
    def metrics(self) -> pl.LazyFrame:
        """One row an episode of AWS's metrics files: METRIC_COLUMNS."""
        return self._read_metrics[0].lazy()

    @property
    def training(self) -> pl.LazyFrame:
        """The ticks of the training alone."""
        return self._of("training")

    @property
    def evaluations(self) -> pl.LazyFrame:
        """The ticks of evaluations and submissions."""
        import polars as pl

        return self.ticks.filter(pl.col("phase") != "training")

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files; the column `file` is an index among them."""
        return tuple(source.name for source in self.sources)

    @cached_property
    def damaged(self) -> tuple[Damage, ...]:
        """What could not be taken as it stands: file, line, what."""
        ticks, damage, _ = self._lazy_ticks.read()
        return (*damage, *self._read_metrics[1], *jumps(ticks, self.files))

    @cached_property
    def about(self) -> RawRow:
        """What the files say beside the ticks, as `about.facts_of` names it."""
        metadata: RawRow = {}
        for source in self.sources:
            if source.kind == ABOUT:
                metadata = {**facts_of(source), **metadata}
        return {**self._lazy_ticks.read()[2], **metadata}

    def require_ticks(self) -> pl.DataFrame:
        """Return the ticks.

        Raises:
            LogError: There is not one; with the first damage, if that is why.
        """
        ticks = self._lazy_ticks.read()[0]
        if not ticks.height:
            none = Damage(self.files[0] if self.files else "", None, "the files hold no row of a simulation trace")
            first = next(iter(self.damaged), none)
            raise LogError(first.file, first.what, EXPECTED, line=first.line)
        return ticks

    def printed(self, text: str) -> Array:
        """Return the rows of `require_ticks` before which their log has a line with a text, (K,) ascending.

        Traces hold no such lines: a row is found in the log beside them by its numbers and by where the car is.
        """
        import polars as pl

        rows = [(one.round, *row) for one in self.sources if one.is_log for row in rows_behind(one, text)]
        found = pl.DataFrame(rows, ["round", "episode", "tick", "x", "y"], orient="row", strict=False).select(
            pl.col("round").cast(pl.Int32), pl.exclude("round").cast(pl.Float64, strict=False)
        ).with_columns(pl.col("episode", "tick").cast(pl.Int32, strict=False))  # fmt: skip
        near = (pl.col("x") - pl.col("x_m")).abs() + (pl.col("y") - pl.col("y_m")).abs() < SAME_PLACE_M
        ticks = self.require_ticks().select("round", "episode", "tick", "x_m", "y_m").with_row_index("row")
        found = ticks.join(found, on=["round", "episode", "tick"], how="inner").filter(near)
        return found["row"].unique().sort().to_numpy()

    def to_pandas(self, names: str = "racecraft") -> pd.DataFrame:
        """Return the ticks as a pandas frame.

        Args:
            names: "racecraft", or "deepracer-utils" for that library's names, degrees and percent, so that cells
                written for it go on.

        Raises:
            MissingExtraError: pandas is not installed.
            LogError: `names` is neither.
        """
        import polars as pl

        if names not in ("racecraft", "deepracer-utils"):
            raise LogError("names", repr(names), '"racecraft" or "deepracer-utils"')
        try:
            import pandas as pd
        except ImportError:
            raise MissingExtraError("to_pandas needs pandas; install it with: pip install pandas") from None
        frame = self._lazy_ticks.read()[0]
        words = {column: pl.col(column).cast(pl.String) for column in ("phase", "status")}
        frame = frame.with_columns(**words)
        if names == "deepracer-utils":
            frame = _in_their_words(frame)
        return pd.DataFrame({name: frame[name].to_numpy() for name in frame.columns})

    def _of(self, phase: str) -> pl.LazyFrame:
        import polars as pl

        return self.ticks.filter(pl.col("phase") == phase)

    @cached_property
    def _lazy_ticks(self) -> LazyTicks:
        return LazyTicks(self.sources, self.phase)

    @cached_property
    def _read_metrics(self) -> tuple[pl.DataFrame, list[Damage]]:
        if not any(source.kind == METRICS for source in self.sources):
            return read_metrics((), self.phase)
        return read_metrics(self.sources, self.phase)


THEIRS = {
    "X": "x", "Y": "y", "steer": "steering_angle", "throttle": "speed", "all_wheels_on_track": "on_track",
}  # fmt: skip
"""Columns that deepracer-utils calls otherwise than the trace does."""


def _in_their_words(frame: pl.DataFrame) -> pl.DataFrame:
    """Return the ticks under deepracer-utils' names and in AWS's units."""
    import polars as pl

    named = {ours: THEIRS.get(theirs, theirs) for theirs, ours in OURS.items()}
    kept = ("iteration", "worker", "unique_episode", "stream")
    return frame.select(
        *(pl.col(ours).alias(theirs) for ours, theirs in named.items() if ours != "obstacle_crashes"), *kept
    ).with_columns(
        pl.col("yaw").degrees(),
        pl.col("steering_angle").degrees(),
        pl.col("progress") * 100.0,
        pl.col("steps").cast(pl.Float64),
    )
