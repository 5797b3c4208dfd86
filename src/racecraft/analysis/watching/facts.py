"""What a page says of any run, whatever it trains: where it stands, its curves, what can be seen of it."""

from __future__ import annotations

from typing import Any

from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder, last_stops
from racecraft.formats.tensor_file import CheckpointError

CAR = "deepracer"
SCORES = {CAR: "progress %", "gymnasium": "return", "battlesnake": "rating", "unity": "return"}
"""What a kind's score is called."""
ELSEWHERE = {
    "gymnasium": "What a Gymnasium environment looks like stays in the environment; its curves are here.",
    "battlesnake": (
        "A snake's training games are not kept; its curves are here. "
        "`racecraft snakes watch --live --url RUN --url search` plays one before your eyes."
    ),
    "unity": "What a Unity scene looks like is seen in Unity; its curves are here.",
}
"""Why a kind has no map, for people."""


def run_facts(run: RunFolder, job: dict[str, Any]) -> dict[str, Any]:
    """Return what a page says first.

    Args:
        run: The run.
        job: What `RunFolder.read_job` told.
    """
    kind = str(job.get("kind"))
    return {
        "path": str(run.path),
        "name": run.path.name,
        "title": str(job.get("title", run.path.name)),
        "kind": kind,
        "algorithm": str(job.get("algorithm", "")),
        "stops": list(last_stops(job)),
        "started": str(job.get("started", "")),
        "seed": job.get("seed"),
        "score_name": SCORES.get(kind, "score"),
        "training": run.is_training(),
        "has_map": kind == CAR,
        "instead": "" if kind == CAR else ELSEWHERE.get(kind, "Its curves are here."),
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
