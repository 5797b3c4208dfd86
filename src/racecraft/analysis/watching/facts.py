"""What a page says of any run, whatever it trains: where it stands, its curves, what can be seen of it."""

from __future__ import annotations

from typing import Any

from racecraft.contract.kinds import find_kind
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder, last_stops
from racecraft.formats.tensor_file import CheckpointError

CURVES_ONLY = "Its curves are here."
"""What stands in the map's place, for worlds that say nothing themselves."""


def run_facts(run: RunFolder, job: dict[str, Any]) -> dict[str, Any]:
    """Return what a page says first.

    Args:
        run: The run.
        job: What `RunFolder.read_job` told.
    """
    kind = find_kind(str(job.get("kind")), str(run.path))
    return {
        "path": str(run.path),
        "name": run.path.name,
        "title": str(job.get("title", run.path.name)),
        "kind": kind.name,
        "algorithm": str(job.get("algorithm", "")),
        "stops": list(last_stops(job)),
        "started": str(job.get("started", "")),
        "seed": job.get("seed"),
        "score_name": kind.score.short,
        "training": run.is_training(),
        "has_map": bool(kind.watch),
        "instead": "" if kind.watch else kind.look or CURVES_ONLY,
        "best": _best(run),
    }


def curves(run: RunFolder, after: int = 0) -> list[dict[str, float | None]]:
    """Return the figures of every iteration behind `after`, in order; what is no number is left out.

    Raises:
        RunFolderError: A line of the metrics is damaged.
    """
    return [
        {name: value for name, value in row.items() if value is None or isinstance(value, int | float)}
        for row in run.read_metrics()
        if row.get("iteration", 0) > after
    ]


def _best(run: RunFolder) -> int | None:
    """Return the iteration of the best checkpoint; None before there is one."""
    try:
        return Checkpoints(run.checkpoints).find("best").iteration
    except CheckpointError:
        return None
