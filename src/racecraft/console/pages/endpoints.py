"""Put a trained policy behind HTTP, ask it, delete it: each endpoint is a job that runs `racecraft serve`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

import sqlalchemy as sql
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from racecraft.console.index_tables import MODELS
from racecraft.console.model_row import READY
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, form_with_file, in_frame, one, page_routes
from racecraft.console.training import job_name
from racecraft.contract.errors import RacecraftError, SettingError
from racecraft.jobs.job import Job
from racecraft.sagemaker.endpoint import EndpointError, Predictor, deploy
from racecraft.web.errors import WebError

MAX_FILE_BYTES = 16 * 1024**2
"""Of a picture or an array that is asked about; as much as an endpoint unpacks."""
CONTENT_TYPES = {
    ".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg", ".npy": "application/x-npy",
    ".npz": "application/x-npz", ".json": "application/json",
}  # fmt: skip
MAX_ZEROS = 200
"""Numbers of an example; one of a picture would fill the page."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of endpoints."""

    async def ask(request: Request) -> Response:
        async with form_with_file(request, "file") as (fields, file):
            name = file.filename or "" if file else ""
            body = await file.read(MAX_FILE_BYTES + 1) if file else one(fields, "body").encode()
        page = await run_in_threadpool(asked_page, console, request, body, name)
        return await run_in_threadpool(in_frame, console, request, page)

    return [
        *page_routes(console, "/endpoints", endpoints_page),
        act_route(console, "/endpoints", begin),
        *page_routes(console, "/endpoints/{name}", endpoint_page),
        Route("/endpoints/{name}", ask, methods=["POST"]),
        act_route(console, "/endpoints/{name}/delete", delete),
    ]


def endpoints_page(console: Console, request: Request) -> Page:
    """Return every endpoint of this account, and what can become one."""
    chosen = request.query_params.get("m", "")
    can_answer = sql.or_(MODELS.c.status == READY, MODELS.c.iterations > 0)
    named = sql.select(MODELS.c.name).where(MODELS.c.run != "", can_answer, MODELS.c.archived.is_(False))
    models = [row["name"] for row in console.index.query(named.order_by(MODELS.c.changed.desc()))]
    data = {"endpoints": [_row(console, job) for job in _jobs(console)], "models": models, "chosen": chosen}
    return Page("endpoints.html", "Endpoints", data, here="/jobs")


def begin(console: Console, request: Request, fields: Fields) -> str:
    """Put the best checkpoint of a model behind HTTP; it answers some seconds later."""
    row = console.index.row(console.workspace.model(one(fields, "model")).name)
    if not row["run"]:
        raise SettingError("{name}: was never trained; expected a model with a training.", name=row["name"])
    name = one(fields, "name").strip() or _free_name(console, row["name"])
    deploy(console.home, Path(row["run"]), name, wait=False)
    console.watcher.refresh()
    return _address(name)


def endpoint_page(console: Console, request: Request) -> Page:
    """Return what an endpoint sees and answers, with a question to begin from."""
    return _page(console, request, {})


def asked_page(console: Console, request: Request, body: bytes, file: str) -> Page:
    """Return the page with the answer to a question.

    Args:
        console: Whose endpoint it is.
        request: Names the endpoint.
        body: What is asked.
        file: Name of the file it was in; "": it was typed, as JSON.
    """
    told: dict[str, Any] = {} if file else {"body": body.decode("utf-8", "replace")}
    status = 200
    try:
        told["answer"] = json.dumps(_answer(console, request.path_params["name"], body, file), indent=2)
    except RacecraftError as error:
        told["wrong"], status = str(error), 422
    return _page(console, request, told, status)


def delete(console: Console, request: Request, fields: Fields) -> str:
    """End an endpoint and forget it; the model stays."""
    Predictor(_job(console, request).name, home=console.home).delete_endpoint()
    console.watcher.refresh()
    return "/endpoints"


class _AsItIs:
    """Sends bytes of a type unchanged.

    Args:
        kind: Their Content-Type.
    """

    def __init__(self, kind: str) -> None:
        self.CONTENT_TYPE = kind

    def serialize(self, data: bytes) -> bytes:
        """Return the body of a request."""
        return data


def _answer(console: Console, name: str, body: bytes, file: str) -> Any:
    kind = CONTENT_TYPES.get(Path(file).suffix.lower() if file else ".json")
    if kind is None or len(body) > MAX_FILE_BYTES:
        raise SettingError(
            "{file}: expected one of {known}, of at most {most} MiB.",
            file=file[:80] or "The question", known=", ".join(CONTENT_TYPES), most=MAX_FILE_BYTES // 1024**2,
        )  # fmt: skip
    return Predictor(name, serializer=_AsItIs(kind), home=console.home).predict(body)


def _page(console: Console, request: Request, told: Mapping[str, Any], status: int = 200) -> Page:
    job = _job(console, request)
    row = _row(console, job)
    predictor, sees = Predictor(job.name, home=console.home), {}
    if row["url"]:
        try:
            sees = predictor.signature()
        except EndpointError:
            row["url"] = ""  # it begins, or was ended this moment
    body = json.dumps({"instances": [_zeros(sees)]}) if sees else ""
    data = {"endpoint": row, "sees": sees, "body": body, "answer": "", "wrong": "", **told}
    return Page("endpoint.html", f"Endpoint {job.name}", data, here="/jobs", status=status)


def _zeros(sees: Mapping[str, Any]) -> Any:
    """Return an observation of nothing but zeros, as far as it can be typed: a picture is sent as a file."""
    parts = {name: _nested(part["shape"]) for name, part in sees["observations"].items()}
    return next(iter(parts.values())) if len(parts) == 1 else parts


def _nested(shape: list[int]) -> Any:
    size = 1
    for one_ in shape:
        size *= one_
    if size > MAX_ZEROS:
        return "…"
    value: Any = 0.0
    for length in reversed(shape):
        value = [value] * length
    return value


def _jobs(console: Console) -> list[Job]:
    return [job for job in reversed(console.home.store().jobs()) if job.spec.recorded.get("endpoint")]


def _job(console: Console, request: Request) -> Job:
    name = request.path_params["name"]
    for job in _jobs(console):
        if job.name == name:
            return job
    raise WebError(404, "no_such_endpoint", f"There is no endpoint {name[:64]!r}; the list shows those that are.")


def _row(console: Console, job: Job) -> dict[str, Any]:
    run = Path(str(job.spec.recorded.get("run", "")))
    row = {"name": job.name, "run": str(run), "ended": job.ended, "reason": job.reason, "state": job.state.value}
    try:
        row["url"] = "" if job.ended else Predictor(job.name, home=console.home).url
    except EndpointError:
        row["url"] = ""
    return row


def _free_name(console: Console, model: str) -> str:
    taken = {job.name for job in console.home.store().jobs()}
    base, number = job_name(model), 1
    while f"{base}-endpoint-{number}" in taken:
        number += 1
    return f"{base}-endpoint-{number}"


def _address(name: str) -> str:
    return f"/endpoints/{quote(name)}"


SECTION = Section(routes=routes)
