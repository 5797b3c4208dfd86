"""A run to watch in a browser, while it trains and after: one page, the JSON it is fed with, and news as they come.

    GET /                 the page (`pages/templates/watch.html`, or the template of the run's world)
    GET /api/run          what is trained, and whether it still is
    GET /api/curves?after=12   the figures of each iteration behind 12; run=NAME: of another run of the same folder
    GET /api/events       the same as /api/run whenever it changes, as Server-Sent Events

What else there is to look at, the run's kind of world answers (`WorldKind.watch`). Everything comes from the run
folder: the training is another process, and may be over.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from racecraft.analysis.watching.facts import curves, run_facts, runs_beside
from racecraft.contract.errors import UserInputError, nearest
from racecraft.contract.kinds import find_kind
from racecraft.formats.run_folder import RunFolder
from racecraft.web.access import ONLY_HERE, Access
from racecraft.web.answers import json_answer, page_answer
from racecraft.web.application import make_application
from racecraft.web.errors import WebError
from racecraft.web.ports import LOOPBACK
from racecraft.web.push import Topic, events_answer
from racecraft.web.query import whole_number
from racecraft.web.server import ServerThread, address_of

Answer = Callable[[Request], Any]
"""Answers a request with a value for JSON, or with a whole `Response`; it runs in a thread."""
LOOK_SECONDS = 1.0
"""Between two looks at the run folder, while somebody has the page open."""
NICENESS = 5
"""Of the threads that serve the page: a training comes first."""


@dataclass(frozen=True)
class WatchSource:
    """What a world adds to the page of its runs; what its hook `watch` returns."""

    template: str = "watch.html"
    """Of the page; a world's own extends this one and fills the block `stage`."""
    answers: Mapping[str, Answer] = field(default_factory=dict)
    """By path: what the page's modules ask for."""
    news: Callable[[], Mapping[str, Any]] = dict
    """Returns what is told with the run's facts whenever any of it changes, such as which iterations are kept."""


def watch_routes(run: RunFolder, base: str = "/") -> list[Route]:
    """Return the routes of a run's page.

    Args:
        run: The run folder.
        base: Where they stand in the server, with a slash at its end.

    Raises:
        MissingWorldError: The run's kind of world is not installed.
        UserInputError: What the run was trained in is gone.
    """
    job = run.read_job()
    of_world = find_kind(str(job.get("kind")), str(run.path)).piece("watch")
    source: WatchSource = of_world(run) if of_world else WatchSource()
    facts = _Facts(run, job, source)
    news = Topic("run", facts.read, LOOK_SECONDS)

    def page(request: Request) -> Response:
        context: dict[str, Any] = {"from": base, "instead": facts.read()["instead"], "beside": list(runs_beside(run))}
        context["with"] = request.query_params.getlist("with")
        return page_answer(request, source.template, title=run.path.name, **context)

    async def events(request: Request) -> Response:
        return events_answer(request, [news])

    answers = {
        "api/run": lambda request: facts.read(),
        "api/curves": lambda request: {"rows": curves(_named(run, request), whole_number(request, "after", 0))},
        **source.answers,
    }
    routes = [Route(base, page), Route(f"{base}api/events", events)]
    return routes + [Route(base + path, _endpoint(answer)) for path, answer in answers.items()]


def _named(run: RunFolder, request: Request) -> RunFolder:
    """Return the run whose curves are asked for."""
    name = request.query_params.get("run")
    beside = {} if name is None else runs_beside(run)
    if name is not None and name not in beside:
        raise WebError(
            404, "no_such_run", f"There is no run {name[:80]!r} beside this one. {nearest(name[:80], beside)}"
        )
    return run if name is None else beside[name]


class _Facts:
    """What a page says of a run, read anew each time; metrics only where their file has grown."""

    def __init__(self, run: RunFolder, job: dict[str, Any], source: WatchSource) -> None:
        self._run, self._job, self._source = run, job, source
        self._size, self._last = -1, 0

    def read(self) -> dict[str, Any]:
        """Return the facts, `last`: the number of the last iteration, and the world's news."""
        size = self._run.metrics.stat().st_size if self._run.metrics.is_file() else 0
        if size != self._size:
            rows = curves(self._run, self._last)
            self._size, self._last = size, int(rows[-1]["iteration"] or 0) if rows else self._last
        return run_facts(self._run, self._job) | {"last": self._last} | dict(self._source.news())


def _endpoint(answer: Answer) -> Callable[[Request], Response]:
    def endpoint(request: Request) -> Response:
        try:
            value = answer(request)
        except UserInputError as error:
            raise WebError(404, "not_kept", str(error)) from error
        return value if isinstance(value, Response) else json_answer(value)

    return endpoint


class WatchServer:
    """Serves one run in a thread of its own.

    Args:
        run: The run folder.
        access: Who may look.

    Raises:
        MissingWorldError: The run's kind of world is not installed.
        UserInputError: What the run was trained in is gone.
    """

    def __init__(self, run: RunFolder, access: Access = ONLY_HERE) -> None:
        self._access = access
        self._thread = ServerThread(make_application(watch_routes(run), access), "racecraft-watch", niceness=NICENESS)

    def start(self, port: int = 0, host: str = LOOPBACK) -> str:
        """Begin to serve; return the address.

        Raises:
            PortError: The port cannot be listened on.
        """
        return address_of(host, self._thread.start(host, port), self._access)

    def close(self) -> None:
        """Stop; closing twice is closing once."""
        self._thread.close()
