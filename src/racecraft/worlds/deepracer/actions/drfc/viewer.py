"""Pages of a DeepRacer-for-Cloud folder: the viewer, the page of its logs, its report."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.actions.report import Reported
from racecraft.actions.watch import WatchedRun
from racecraft.contract.progress import Progress, quiet
from racecraft.worlds.deepracer.actions.drfc.installation import Installation, InstallationRequest
from racecraft.worlds.deepracer.actions.drfc.jobs import StartedJob, begin_job, latest_job, stop_job, trained_model
from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder
from racecraft.worlds.deepracer.files.drfc_jobs import VIEWER

BEGINS_SECONDS = 60.0
"""So long a page waits for the run folder of a training that is just beginning."""


@dataclass(frozen=True)
class ClosedViewer:
    """Whether a viewer was closed."""

    is_closed: bool


@action
def start_viewer(request: InstallationRequest, progress: Progress = quiet) -> StartedJob:
    """Watch the cars of this run id train, on a page at DR_WEBVIEWER_PORT, until dr-stop-viewer.

    Example: racecraft dr start-viewer
    """
    return begin_viewer(request.installation, request.installation.open())


@action
def run_viewer(request: InstallationRequest, progress: Progress = quiet) -> WatchedRun:
    """Serve the page in this process; dr-start-viewer has it done in the background."""
    from racecraft.actions.watch import serve_watched
    from racecraft.formats.run_folder import JOB

    drfc = request.installation.open()
    until = time.monotonic() + BEGINS_SECONDS
    while not (drfc.model / JOB).is_file() and time.monotonic() < until:
        time.sleep(0.5)
    return serve_watched(drfc.model, _port(drfc), progress)


@action
def stop_viewer(request: InstallationRequest, progress: Progress = quiet) -> ClosedViewer:
    """Close the page of dr-start-viewer; the training goes on.

    Example: racecraft dr stop-viewer
    """
    from racecraft.jobs.states import State

    job = latest_job(request.installation.open(), VIEWER)
    if job is None or job.ended:
        why = f" ({job.name} ended by itself: {job.reason})" if job is not None and job.state is State.FAILED else ""
        progress(f"no viewer is open, so nothing was closed{why}")
        return ClosedViewer(False)
    stop_job(job)
    return ClosedViewer(True)


@action
def start_loganalysis(request: InstallationRequest, progress: Progress = quiet) -> Figures:
    """Write the page of plots that the log notebooks draw, of this model's logs.

    Example: racecraft dr start-loganalysis
    """
    from racecraft.worlds.deepracer.actions.logs import logs

    model = trained_model(request.installation.open()).path
    _require_rows(model)
    return logs(paths=[model], page=model / "logs.html")


@action
def start_metrics(request: InstallationRequest, progress: Progress = quiet) -> Reported:
    """Write the page of this model: curves, best lap, actions, settings, cost.

    Example: racecraft dr start-metrics
    """
    from racecraft.actions.report import report

    return report(trained_model(request.installation.open()).path)


def begin_viewer(installation: Installation, drfc: DrfcFolder) -> StartedJob:
    """Serve the page in the background.

    Raises:
        RunEnvError: DR_WEBVIEWER_PORT is no port.
    """
    address = f"http://localhost:{_port(drfc)}"
    job = latest_job(drfc, VIEWER)
    if job is not None and not job.ended:
        return StartedJob(job.name, drfc.model, f"the viewer is open already: {address}")
    job = begin_job(installation, drfc, VIEWER, drfc.model, ("run-viewer",))
    sentence = f"{address} shows {drfc.model} in a moment; dr-stop-viewer closes it"
    return StartedJob(job.name, drfc.model, sentence)


def _port(drfc: DrfcFolder) -> int:
    port = drfc.env.run.number("DR_WEBVIEWER_PORT", 8100, 1, 65535)
    if port != int(port):
        raise drfc.error_at("DR_WEBVIEWER_PORT", "a whole number from 1 to 65535")
    return int(port)


def _require_rows(model: Path) -> None:
    """Refuse a model whose training has not finished an iteration yet.

    Raises:
        LogError: No simulation trace of the model has a row.
    """
    from racecraft.worlds.deepracer.files.model_folder import AwsModelFolder
    from racecraft.worlds.deepracer.logs.sources import LogError

    for trace in AwsModelFolder(model).training_traces().values():
        with trace.open("rb") as file:
            if len(file.readlines(4096)) > 1:
                return
    raise LogError(
        model, "no row of a simulation trace yet", "a training that has finished its first iteration",
        "dr-logs-sagemaker shows how far it is.",
    )  # fmt: skip
