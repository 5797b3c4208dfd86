"""`dr-stop-all`: stop whatever is at work."""

from __future__ import annotations

import typer

from racecraft.worlds.deepracer.actions.drfc.jobs import latest_job, stop_job
from racecraft.worlds.deepracer.cli.dr.context import installation


def stop_all(context: typer.Context) -> None:
    """Stop all that is at work for this run id: its training, its evaluation, its viewer.

    Example: racecraft dr stop-all
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import EVALUATION, TRAINING, VIEWER

    drfc = installation(context)
    found = [latest_job(drfc, kind) for kind in (TRAINING, EVALUATION, VIEWER)]
    at_work = [job for job in found if job is not None and not job.ended]
    for job in at_work:
        print(f"{job.name}: {stop_job(job).state}")
    if not at_work:
        print(f"run id {drfc.run_id}: nothing is at work, so nothing was stopped")
