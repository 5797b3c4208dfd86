"""`racecraft serve`."""

from __future__ import annotations

from racecraft.actions.serve import ServedPolicy
from racecraft.actions.serve import serve as action
from racecraft.cli.from_request import command


def _show(served: ServedPolicy) -> None:
    print(f"{served.run} answers at {served.url}/invocations (Ctrl-C ends)", flush=True)


serve = command(action, _show)
