"""Judge what was trained, whatever its world."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from racecraft.evaluation.evaluate_run import evaluate_run


def evaluate(run: str | Path, **words: Any) -> dict[str, Any]:
    """Judge the greedy policy of a run; return the figures that `racecraft evaluate --json` prints.

    Args:
        run: The run folder; RUN:best, RUN:last and RUN:N name a checkpoint.
        words: Of a car: `track`, `laps`, or `tracks`, several names, for a row a track. Of others: `episodes`, `seed`.

    Raises:
        RunFolderError: There is no run folder.
        CheckpointError: No such checkpoint.
    """
    return evaluate_run(run, **words)
