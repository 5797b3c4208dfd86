"""What a run left, as tables, and its policy by itself."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.formats.checkpoint import CheckpointEntry, Checkpoints
from racecraft.formats.checkpoint_ranking import split_source
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import TrainedPolicy, load_policy

if TYPE_CHECKING:
    import polars as pl

__all__ = ["Run", "load_policy", "read_run"]


@dataclass(frozen=True)
class Run:
    """A run folder, read."""

    folder: RunFolder

    @property
    def path(self) -> Path:
        """Where it lies."""
        return self.folder.path

    @property
    def job(self) -> dict[str, Any]:
        """What was asked: kind, settings, seed, versions, machine."""
        return self.folder.read_job()

    @property
    def kind(self) -> str:
        """Which kind of world, such as "deepracer"."""
        return str(self.job["kind"])

    @property
    def checkpoints(self) -> list[CheckpointEntry]:
        """Every checkpoint that is kept, by iteration."""
        return Checkpoints(self.folder.checkpoints).entries()

    def metrics(self) -> pl.DataFrame:
        """Return one row an iteration; docs/reference/metrics.md explains every column."""
        import polars as pl

        return pl.DataFrame(self.folder.read_metrics(), infer_schema_length=None)

    def episodes(self) -> pl.LazyFrame:
        """Return every recorded tick, lazily; docs/reference/episode_columns.md explains every column (cars only)."""
        import polars as pl

        return pl.scan_parquet(self.folder.episodes / "*.parquet")

    def policy(self, which: str = "best") -> TrainedPolicy:
        """Return the policy of a checkpoint: "best", "last" or the number of an iteration."""
        return load_policy(self.folder, which)


def read_run(path: str | Path) -> Run:
    """Return a run folder, read.

    Raises:
        RunFolderError: There is no run folder there.
    """
    return Run(RunFolder.open(split_source(str(path))[0]))
