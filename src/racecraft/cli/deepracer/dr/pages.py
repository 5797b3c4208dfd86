"""`dr-start-viewer`, `dr-start-loganalysis`, `dr-start-metrics`: what a model shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from racecraft.cli.deepracer.dr.here import NothingToDoError, installation

if TYPE_CHECKING:
    from racecraft.formats.aws.drfc_folder import DrfcFolder


def start_viewer(context: typer.Context) -> None:
    """Watch the cars of this run id train.

    Example: racecraft dr start-viewer
    """
    open_viewer(installation(context))


def stop_viewer(context: typer.Context) -> None:
    """Close the viewer.

    Example: racecraft dr stop-viewer
    """
    print("no viewer is open, so nothing was closed")


def open_viewer(drfc: DrfcFolder) -> None:
    """Say how cars are watched today.

    Raises:
        NothingToDoError: There is no live viewer yet.
    """
    raise NothingToDoError(
        f"there is no live viewer yet; expected patience. `racecraft evaluate {drfc.model} --video lap.mp4` films the "
        f"best policy so far, `racecraft report {drfc.model}` writes a page with all curves, while it trains, too."
    )


def start_loganalysis(context: typer.Context) -> None:
    """Write the page of plots that the log notebooks draw, of this model's logs.

    Example: racecraft dr start-loganalysis
    """
    from racecraft.cli.deepracer.logs import logs

    model = installation(context).model
    logs([model], page=model / "logs.html")


def start_metrics(context: typer.Context) -> None:
    """Write the page of this model: curves, best lap, actions, settings, cost.

    Example: racecraft dr start-metrics
    """
    from racecraft.cli.runs.report import report

    report(installation(context).model)
