"""The live map of every model: what `racecraft watch` answers for one run, below each model's address."""

from __future__ import annotations

from collections import OrderedDict
from pathlib import Path

from starlette.concurrency import run_in_threadpool
from starlette.routing import Router
from starlette.types import Receive, Scope, Send

from racecraft.console.service import Console
from racecraft.formats.run_folder import RunFolder
from racecraft.serving.watch_server import watch_routes
from racecraft.web.errors import WebError

MOST = 8
"""Runs whose maps and cameras are kept ready, those looked at last."""


class Watching:
    """Answers below /models/NAME/watch/ for the model's newest run.

    Args:
        console: Whose models.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._routers: OrderedDict[str, Router] = OrderedDict()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request."""
        name = scope["path_params"]["name"]
        router = await run_in_threadpool(self._router, name)
        try:
            await router(scope, receive, send)
        except OSError as error:
            raise WebError(404, "not_kept", f"{name}: {error.strerror}; expected a whole run.") from error

    def _router(self, name: str) -> Router:
        run = str(self._console.index.row(name)["run"])
        if not run:
            raise WebError(404, "no_run", f"{name} has no training yet; expected one that has begun.")
        if run not in self._routers:
            self._routers[run] = Router(watch_routes(RunFolder.open(Path(run))))
        self._routers.move_to_end(run)
        while len(self._routers) > MOST:
            self._routers.popitem(last=False)
        return self._routers[run]
