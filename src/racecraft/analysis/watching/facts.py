"""What a page says of any run, whatever it trains: where it stands, its curves, what can be seen of it."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from racecraft.contract.errors import RunFolderError
from racecraft.contract.kinds import find_kind
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import JOB, RunFolder, last_stops
from racecraft.formats.tensor_file import CheckpointError

CURVES_ONLY = "Its curves are here."
"""What stands in the map's place, for worlds that say nothing themselves."""
MOST_BESIDE = 50
"""Runs, the newest, whose curves a page offers beside its own."""


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


def runs_beside(run: RunFolder) -> dict[str, RunFolder]:
    """Return the runs of the same kind of world in the same folder by name, the newest first; not the run itself."""
    path, kind = run.path.absolute(), run.read_job().get("kind")
    found = []
    for job in path.parent.glob(f"*/{JOB}"):
        with suppress(RunFolderError):
            other = RunFolder(job.parent)
            found.append((str(other.read_job_of(str(kind)).get("started", "")), other))
    found.sort(key=lambda one: one[0], reverse=True)
    return {other.path.name: other for _, other in found[:MOST_BESIDE] if other.path != path}


def _best(run: RunFolder) -> int | None:
    """Return the iteration of the best checkpoint; None before there is one."""
    try:
        return Checkpoints(run.checkpoints).find("best").iteration
    except CheckpointError:
        return None
