"""A model's row of the index, from its runs and its jobs. Begin with `model_row`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import Any

from racecraft.console.run_row import RunRow
from racecraft.console.workspace import Model, Note
from racecraft.jobs.job import Job
from racecraft.jobs.states import State

TRAINING, STOPPING, QUEUED, READY, ERROR, NEW = "training", "stopping", "queued", "ready", "error", "new"
GONE = "gone"
"""Its run folder was there and is no longer; its row says what it was."""
SHOWN = ("kind", "algorithm", "place", "picture", "about", "curve", "iterations", "steps", "seconds", "speed", "stops")
"""What a model shows of its newest run."""
BEST = ("rank", "best_text", "gap_percent")
"""What it shows of its best one."""


def model_row(
    model: Model, note: Note, runs: Sequence[RunRow], jobs: Sequence[Job], is_held: Callable[[str], bool]
) -> dict[str, Any]:
    """Return a model's row.

    Args:
        model: The model.
        note: What people say of it.
        runs: Its runs, the oldest first.
        jobs: The jobs that train into its folder, the oldest first.
        is_held: Tells whether a process trains in a run folder.
    """
    newest = runs[-1] if runs else RunRow(path="", mark="", kind=note.kind, place=note.place, picture=note.picture)
    status, reason, job = _status(runs, jobs, is_held)
    judged = [run for run in runs if run.kind == newest.kind and run.rank is not None]
    best = min(judged, key=lambda run: run.rank or 0.0, default=newest)
    shown = asdict(newest)
    return {
        "name": model.name,
        "owner": "",
        "path": str(model.path),
        "run": newest.path,
        "status": status,
        "reason": reason,
        "job": "" if job is None else job.name,
        **{name: shown[name] for name in SHOWN},
        "curve": list(newest.curve),
        "stops": list(newest.stops),
        **{name: getattr(best, name) for name in BEST},
        "runs": len(runs),
        "changed": max([newest.changed, note.created, *(one.transitions[-1].time for one in jobs)]),
        "archived": note.archived,
        "tags": list(note.tags),
        "cloned_from": note.cloned_from,
        "text": note.text,
        "search": " ".join(
            [model.name, newest.place, newest.about, *(f"#{tag} " for tag in note.tags), note.text]
        ).casefold(),
    }


def _status(runs: Sequence[RunRow], jobs: Sequence[Job], is_held: Callable[[str], bool]) -> tuple[str, str, Job | None]:
    """Return what a model does now, why, and the job that does it."""
    job = jobs[-1] if jobs else None
    if job is not None and job.waits:
        return QUEUED, job.reason, job
    if job is not None and job.worked_at:
        return (STOPPING if job.state is State.STOPPING else TRAINING), job.reason, job
    if runs and is_held(runs[-1].path):
        return TRAINING, "", None
    if job is not None and job.state is State.FAILED and (not runs or runs[-1].changed <= job.transitions[-1].time):
        return ERROR, job.reason, job
    if runs and runs[-1].fault:
        return ERROR, runs[-1].fault, job
    if any(run.iterations or run.is_imported for run in runs):
        return READY, "", job
    if job is None:
        return NEW, "", None
    return NEW, "It ended before its first iteration." if runs else "It was stopped before it began.", job


def gone_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return the row of a model whose run folder is gone, from its last one."""
    if row["status"] == GONE:
        return dict(row)
    reason = f"{row['run']}: this folder is gone. Put it back and it goes on as before, or delete the model here."
    return {**row, "status": GONE, "reason": reason, "run": "", "job": ""}
