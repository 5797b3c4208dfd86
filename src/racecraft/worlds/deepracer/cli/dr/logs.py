"""`dr-logs-sagemaker`, `dr-logs-robomaker`: what a training or an evaluation says, as it says it."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated

import typer

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.actions.drfc.jobs import latest_job, require_job
from racecraft.worlds.deepracer.cli.dr.context import follow_file, follow_job, installation

if TYPE_CHECKING:
    from racecraft.jobs.job import Job
    from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder

All = Annotated[bool, typer.Option("-a", help="Of all that is at work: there is one program, so it is one log.")]
Wait = Annotated[int, typer.Option("-w", min=0, help="Wait so many seconds for it to begin.")]


def logs_sagemaker(context: typer.Context, wait: Wait = 0, all_logs: All = False) -> None:
    """Show what the training of this run id says, an iteration a line, until it ends or Ctrl-C.

    Example: racecraft dr logs-sagemaker
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import TRAINING

    drfc = installation(context)
    _wait_for(drfc, TRAINING, wait)
    follow_job(require_job(drfc, TRAINING, "dr-start-training"))


def logs_robomaker(
    context: typer.Context,
    worker: Annotated[int, typer.Option("-n", help="Of which simulator; all cars of a training write one log, 1.")] = 1,
    evaluation: Annotated[bool, typer.Option("-e", help="Of the evaluation instead of the training.")] = False,
    wait: Wait = 0,
    all_logs: All = False,
) -> None:
    """Show the log of the simulator: every tick as a SIM_TRACE_LOG line, until the training ends or Ctrl-C.

    Examples:

        racecraft dr logs-robomaker

        racecraft dr logs-robomaker -e
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import EVALUATION, TRAINING

    drfc = installation(context)
    kind, begins = (EVALUATION, "dr-start-evaluation") if evaluation else (TRAINING, "dr-start-training")
    _wait_for(drfc, kind, wait)
    job = require_job(drfc, kind, begins)
    if evaluation:
        follow_job(job)
    else:
        follow_simulator(drfc, job, worker)


def follow_simulator(drfc: DrfcFolder, job: Job, worker: int) -> None:
    """Print the simulation log of a training as it grows.

    Raises:
        SettingError: There is no such simulator.
    """
    from pathlib import Path

    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.store import get
    from racecraft.worlds.deepracer.files.model_folder import AwsModelFolder

    if worker != 1:
        raise SettingError(
            "worker {worker}: all cars of a training write one log; expected 1, or no number.", worker=worker
        )
    store = JobPaths.of_user().store()
    log = AwsModelFolder(Path(job.spec.run)).simulation_log
    follow_file(log, lambda: get(store, job.name).ended, job.name)


def _wait_for(drfc: DrfcFolder, kind: str, seconds: int) -> None:
    until = time.monotonic() + seconds
    while latest_job(drfc, kind) is None and time.monotonic() < until:
        time.sleep(0.5)
