"""A run to watch in a browser, while it trains and after: one page and the JSON it is fed with.

    GET /                 the page (`analysis/watching/page.html`)
    GET /api/run          what is trained, and whether it still is
    GET /api/curves?after=12   the figures of each iteration behind 12

What else there is to look at, the run's kind of world answers (`WorldKind.watch`).

Everything comes from the run folder: the training is another process, and may be over. Only this machine is served.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

from racecraft.analysis.watching.facts import curves, run_facts
from racecraft.analysis.watching.page import watch_page
from racecraft.contract.errors import UserInputError
from racecraft.contract.kinds import find_kind
from racecraft.formats.run_folder import RunFolder
from racecraft.serving.http_service import HttpError, HttpService, Reply, Request
from racecraft.serving.query import whole_number
from racecraft.serving.service_thread import ServiceThread
from racecraft.web.ports import LOOPBACK

Answer = Callable[[Request], Any]
"""Answers a request with a value for JSON, or with a whole `Reply`."""

FRESH = (("Cache-Control", "no-store"),)


class WatchServer:
    """Serves one run on this machine, in a thread of its own.

    Args:
        run: The run folder.

    Raises:
        MissingWorldError: The run's kind of world is not installed.
        UserInputError: What the run was trained in is gone.
    """

    def __init__(self, run: RunFolder) -> None:
        self._run, self._job = run, run.read_job()
        of_world = find_kind(str(self._job.get("kind")), str(run.path)).piece("watch")
        self._answers: Mapping[str, Answer] = self._about_any() | (of_world(run) if of_world else {})
        self._page = watch_page(run.path.name).encode()
        self._thread = ServiceThread(HttpService(self._answer), "racecraft-watch")

    def start(self, port: int = 0) -> str:
        """Begin to serve; return the address.

        Raises:
            PortError: The port cannot be listened on.
        """
        return f"http://{LOOPBACK}:{self._thread.start(LOOPBACK, port)}/"

    def close(self) -> None:
        """Stop; closing twice is closing once."""
        self._thread.close()

    async def _answer(self, request: Request) -> Reply:
        if request.method != "GET":
            raise HttpError(405, "wrong_method", "a run can only be watched: GET.")
        if request.path == "/":
            return Reply(self._page, "text/html; charset=utf-8", FRESH)
        if request.path not in self._answers:
            raise HttpError(404, "no_such_page", f"there is no {request.path[:80]} for this run; begin at /.")
        try:
            value = self._answers[request.path](request)
        except UserInputError as error:
            raise HttpError(404, "not_kept", str(error)) from error
        if isinstance(value, Reply):
            return value
        return Reply(json.dumps(value, separators=(",", ":"), allow_nan=False).encode(), headers=FRESH)

    def _about_any(self) -> dict[str, Answer]:
        run = self._run
        return {
            "/api/run": lambda request: run_facts(run, self._job),
            "/api/curves": lambda request: {"rows": curves(run, whole_number(request, "after", 0))},
        }
