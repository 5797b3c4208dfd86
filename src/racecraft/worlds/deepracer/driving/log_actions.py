"""Which actions of a table a log chose. See `chosen_actions`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.driving.demand import unused_actions
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionSpace, ActionTable, action_space
from racecraft.worlds.deepracer.files.model_metadata import read_model_metadata
from racecraft.worlds.deepracer.logs.read import read

METADATA = "model_metadata.json"


@dataclass(frozen=True, eq=False)
class ChosenActions:
    """A log's table, and how often each action was chosen."""

    actions: ActionSpace
    counts: np.ndarray
    """(A,) by number; empty where actions are continuous."""
    ticks: int
    """Ticks in which the car chose."""
    is_whole: bool
    """Whether the table is known from a file; otherwise it is what the log chose."""

    @property
    def never(self) -> list[str]:
        """The labels of the actions that were never chosen."""
        return unused_actions(self.actions, self.counts)


def chosen_actions(log: Path, table: ActionSpace | None = None) -> ChosenActions:
    """Return what a log chose.

    Args:
        log: Whatever `racecraft logs` reads.
        table: The log's action table; None: of the model_metadata.json in the log's folder, else the actions that the
            log names, of which none is unused.

    Raises:
        LogError: There is no log.
        SettingError: The log chose numbers that the table does not have.
    """
    import polars as pl

    ticks = read(log).require_ticks()
    ticks = ticks.filter((pl.col("status") != "prepare").fill_null(True))
    used = ticks.filter(pl.col("action") >= 0).group_by("action").agg(
        pl.len(), pl.col("steering_rad").first(), pl.col("speed_mps").first()
    ).sort("action")  # fmt: skip
    known = table or _table_beside(log)
    actions = known or ActionTable.of(used.select("steering_rad", "speed_mps").rows())
    if isinstance(actions, ActionBox):
        return ChosenActions(actions, np.zeros(0, np.int64), ticks.height, is_whole=True)
    numbers = used["action"].to_numpy() if known else np.arange(used.height)
    if len(numbers) and numbers.max() >= len(actions.steering):
        raise SettingError(
            "{log} chose action {max}; expected at most {count}, its table's last. "
            "Name the log's own table with --table.",
            log=log,
            max=numbers.max(),
            count=len(actions.steering) - 1,
        )
    counts = np.zeros(len(actions.steering), np.int64)
    counts[numbers] = used["len"].to_numpy()
    return ChosenActions(actions, counts, ticks.height, known is not None)


def _table_beside(log: Path) -> ActionSpace | None:
    folder = log if log.is_dir() else log.parent
    found = next(iter(sorted(folder.rglob(METADATA))), None)
    return None if found is None else action_space(read_model_metadata(found).action_space)
