"""What a training or an evaluation of a DeepRacer-for-Cloud folder says, as it says it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.actions.action import action
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import option
from racecraft.worlds.deepracer.actions.drfc.installation import InstallationRequest
from racecraft.worlds.deepracer.actions.drfc.jobs import StartedJob, latest_job, log_of, require_job

if TYPE_CHECKING:
    from racecraft.jobs.job import Job
    from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder


@dataclass(frozen=True, kw_only=True)
class LogRequest(InstallationRequest):
    """Which installation, and how long its job is waited for."""

    wait: int = option(0, "Wait so many seconds for it to begin.", "-w", low=0)
    all_logs: bool = option(False, "Of all that is at work: there is one program, so it is one log.", "-a")


@dataclass(frozen=True, kw_only=True)
class SimulatorLogRequest(LogRequest):
    """Which simulator."""

    worker: int = option(1, "Of which simulator; all cars of a training write one log, 1.", "-n")
    evaluation: bool = option(False, "Of the evaluation instead of the training.", "-e")


@action
def logs_sagemaker(request: LogRequest, progress: Progress = quiet) -> StartedJob:
    """Show what the training of this run id says, an iteration a line, until it ends or Ctrl-C.

    Example: racecraft dr logs-sagemaker
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import TRAINING

    drfc = request.installation.open()
    _wait_for(drfc, TRAINING, request.wait)
    job = require_job(drfc, TRAINING, "dr-start-training")
    return StartedJob(job.name, drfc.model, "", log_of(job))


@action
def logs_robomaker(request: SimulatorLogRequest, progress: Progress = quiet) -> StartedJob:
    """Show the log of the simulator: every tick as a SIM_TRACE_LOG line, until the training ends or Ctrl-C.

    Examples:

        racecraft dr logs-robomaker

        racecraft dr logs-robomaker -e
    """
    from racecraft.worlds.deepracer.files.drfc_jobs import EVALUATION, TRAINING

    drfc = request.installation.open()
    kind, begins = (EVALUATION, "dr-start-evaluation") if request.evaluation else (TRAINING, "dr-start-training")
    _wait_for(drfc, kind, request.wait)
    job = require_job(drfc, kind, begins)
    log = log_of(job) if request.evaluation else simulator_log(job, request.worker)
    return StartedJob(job.name, drfc.model, "", log)


def simulator_log(job: Job, worker: int) -> Path:
    """Return the simulation log that a training writes.

    Raises:
        SettingError: There is no such simulator.
    """
    from racecraft.worlds.deepracer.files.model_folder import AwsModelFolder

    if worker != 1:
        raise SettingError(
            "worker {worker}: all cars of a training write one log; expected 1, or no number.", worker=worker
        )
    return AwsModelFolder(Path(job.spec.run)).simulation_log


def _wait_for(drfc: DrfcFolder, kind: str, seconds: int) -> None:
    until = time.monotonic() + seconds
    while latest_job(drfc, kind) is None and time.monotonic() < until:
        time.sleep(0.5)
