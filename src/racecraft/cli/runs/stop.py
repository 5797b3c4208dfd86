"""`racecraft stop RUN`: ask a training that runs elsewhere to end."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def stop(run: Annotated[Path, typer.Argument(help="The run folder of a training that is under way.")]) -> None:
    """Ask a training to stop, from another terminal: it ends as if Ctrl-C had been pressed, and can go on later.

    Example: racecraft stop runs/reinvent_base-1
    """
    from racecraft.formats.run_folder import RunFolder

    folder = RunFolder.open(run)
    folder.request_stop()
    if folder.is_training():
        print(f"{run}: asked to stop; whatever was kept stays, and --run {run} --resume goes on from there")
    else:
        print(f"{run}: no process of this machine trains there; one of another machine that writes there will stop")
