"""`racecraft stop`."""

from __future__ import annotations

from racecraft.actions.stop import StopRequested
from racecraft.actions.stop import stop as action
from racecraft.cli.from_request import command


def _show(result: StopRequested) -> None:
    run = result.run
    if result.is_training:
        print(f"{run}: stopping; what it has learned stays, and --run {run} --resume goes on from there")
    else:
        print(f"{run}: no process of this machine trains there; one of another machine that writes there will stop")


stop = command(action, _show)
