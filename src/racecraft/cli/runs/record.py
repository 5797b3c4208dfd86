"""`racecraft record`."""

from __future__ import annotations

from racecraft.actions.record import Recorded
from racecraft.actions.record import record as action
from racecraft.cli.from_request import command


def _show(done: Recorded) -> None:
    print(f"{done.file}: {done.episodes} episodes, {done.ticks} ticks, mean return {done.mean_return:.1f}")


record = command(action, _show)
