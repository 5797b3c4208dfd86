"""`dr-start-viewer`, `dr-stop-viewer`, `dr-start-loganalysis`, `dr-start-metrics`: what a model shows."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from racecraft.worlds.deepracer.actions.drfc.jobs import begin_job, latest_job, stop_job, trained_model
from racecraft.worlds.deepracer.cli.dr.context import SHOWN, installation
from racecraft.worlds.deepracer.files.drfc_jobs import VIEWER

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder

BEGINS_SECONDS = 60.0
"""So long a page waits for the run folder of a training that is just beginning."""


def start_viewer(context: typer.Context) -> None:
    """Watch the cars of this run id train, on a page at DR_WEBVIEWER_PORT, until dr-stop-viewer.

    Example: racecraft dr start-viewer
    """
    open_viewer(context, installation(context))


def run_viewer(context: typer.Context) -> None:
    """Serve the page in this process; dr-start-viewer has it done in the background."""
    from racecraft.actions.watch import serve_watched
    from racecraft.cli.runs.watch import show
    from racecraft.formats.run_folder import JOB

    drfc = installation(context)
    until = time.monotonic() + BEGINS_SECONDS
    while not (drfc.model / JOB).is_file() and time.monotonic() < until:
        time.sleep(0.5)
    watched = serve_watched(drfc.model, _port(drfc), SHOWN)
    watched.serve(lambda: show(watched), SHOWN)


def stop_viewer(context: typer.Context) -> None:
    """Close the page of dr-start-viewer; the training goes on.

    Example: racecraft dr stop-viewer
    """
    from racecraft.jobs.states import State

    job = latest_job(installation(context), VIEWER)
    if job is None or job.ended:
        why = f" ({job.name} ended by itself: {job.reason})" if job is not None and job.state is State.FAILED else ""
        print(f"no viewer is open, so nothing was closed{why}")
        return
    stop_job(job)
    print("the viewer is closed")


def open_viewer(context: typer.Context, drfc: DrfcFolder) -> None:
    """Serve the page in the background and say where it is.

    Raises:
        RunEnvError: DR_WEBVIEWER_PORT is no port.
    """
    address = f"http://localhost:{_port(drfc)}"
    job = latest_job(drfc, VIEWER)
    if job is not None and not job.ended:
        print(f"the viewer is open already: {address}")
        return
    begin_job(context.obj, drfc, VIEWER, drfc.model, ("run-viewer",))
    print(f"{address} shows {drfc.model} in a moment; dr-stop-viewer closes it")


def _port(drfc: DrfcFolder) -> int:
    port = drfc.env.run.number("DR_WEBVIEWER_PORT", 8100, 1, 65535)
    if port != int(port):
        raise drfc.error_at("DR_WEBVIEWER_PORT", "a whole number from 1 to 65535")
    return int(port)


def start_loganalysis(context: typer.Context) -> None:
    """Write the page of plots that the log notebooks draw, of this model's logs.

    Example: racecraft dr start-loganalysis
    """
    from racecraft.worlds.deepracer.actions.logs import logs
    from racecraft.worlds.deepracer.cli.logs import show

    model = trained_model(installation(context)).path
    _require_rows(model)
    show(logs(paths=[model], page=model / "logs.html"))


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


def start_metrics(context: typer.Context) -> None:
    """Write the page of this model: curves, best lap, actions, settings, cost.

    Example: racecraft dr start-metrics
    """
    from racecraft.actions.report import report

    print(f"report: {report(trained_model(installation(context)).path).report}")
