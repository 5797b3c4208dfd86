"""A model's page: while it trains and after, with its log, charts, notes and what can be done with it."""

from __future__ import annotations

import contextlib
import shlex
from collections import deque
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Mount, Route

from racecraft.console.merge import both_texts, side_by_side
from racecraft.console.model_row import ERROR, GONE, NEW, QUEUED, READY, STOPPING, TRAINING
from racecraft.console.pages.race_parts import drives_of
from racecraft.console.parts import Figure, WorldParts, checkpoint_text, parts_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, looked, one, page_routes
from racecraft.console.training import stop_training
from racecraft.console.watching import Watching
from racecraft.console.workspace import MODEL_FILE, RUNS, Model, Note, WorkspaceError
from racecraft.contract.errors import RacecraftError, UserInputError
from racecraft.formats.run_folder import RunFolder
from racecraft.jobs import submit
from racecraft.jobs.states import JobError
from racecraft.jobs.store import get
from racecraft.web.errors import WebError

LOG_LINES, LOG_BYTES = 60, 64_000
MAX_NOTE = 10_000
"""Characters."""
TABS = (("Checkpoints", "/checkpoints"), ("Evaluations", "/evaluations"), ("Files", "/files"))


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of a model's own page."""

    def look(request: Request) -> Response:
        return look_at_tab(console, request)

    return [
        Mount("/models/{name}/watch", Watching(console)),
        Route("/models/{name}/{tab}/look", look),
        *page_routes(console, "/models/{name}/{tab}", tab_page),
        *page_routes(console, "/models/{name}", overview),
        act_route(console, "/models/{name}/stop", stop),
        act_route(console, "/models/{name}/resume", resume),
        act_route(console, "/models/{name}/note", write_note),
        act_route(console, "/models/{name}/rename", rename),
        act_route(console, "/models/{name}/{tab}", ask),
    ]


def address(name: str, below: str = "") -> str:
    """Return the address of a model's page."""
    return f"/models/{quote(name)}{below}"


def overview(console: Console, request: Request) -> Page:
    """Return what a model is, how it learns or learned, and what it said."""
    model, row = model_of(console, request)
    run = RunFolder(Path(row["run"])) if row["run"] else None
    metrics = _metrics(run)
    parts = parts_of(row["kind"]) if row["kind"] else None
    live = row["status"] in (TRAINING, STOPPING, QUEUED, NEW)
    sentence = _sentence(run, metrics, live)
    return Page(
        "model.html",
        model.name,
        {
            **frame(row, "Overview", parts),
            **_stage(row, parts),
            "live": live,
            "figures": [asdict(figure) for figure in (*(parts.figures(row) if parts else ()), *_counts(row))],
            "sentence": sentence,
            "charts": [(chart.title, chart.shown()) for chart in parts.charts(row, metrics)] if parts else [],
            "log": _log(console, row, run),
            "commands": {"command": _commands(console, model, row), "python": _python(row)},
            "shared": model.note().shared,
        },
    )


def tab_page(console: Console, request: Request) -> Page:
    """Return one of the pages that a model has from its world."""
    model, row = model_of(console, request)
    tab = request.path_params["tab"]
    parts = parts_of(row["kind"]) if row["kind"] and row["run"] else None
    label = next((label for label, below in (parts.tabs(row) if parts else []) if below == f"/{tab}"), None)
    if parts is None or label is None:
        reason = row["reason"] or f"{model.name} has no page {tab[:40]!r}; begin at its overview."
        raise WebError(404, "no_such_page", reason)
    template, data = parts.tab_page(row, tab, dict(request.query_params), lambda: drives_of(console, request, row))
    task = parts.tab_task(row, tab)
    context = {"task": console.tasks.of(model.name, task[0]) if task else None}
    return Page(template, f"{label}: {model.name}", {**frame(row, label, parts), **context, **data})


def ask(console: Console, request: Request, fields: Fields) -> str:
    """Begin what a page of a model's world can ask for."""
    model, row = model_of(console, request)
    tab = request.path_params["tab"]
    task = parts_of(row["kind"]).tab_task(row, tab) if row["kind"] and row["run"] else None
    if task is None:
        raise WebError(404, "no_such_page", f"{model.name} has nothing to ask for at {tab[:40]!r}.")
    console.tasks.begin(model.name, *task, console.workspace.path)
    return address(model.name, f"/{tab}")


def look_at_tab(console: Console, request: Request) -> Response:
    """Return the closer look of a page that a model has from its world."""
    _, row = model_of(console, request)
    parts = parts_of(row["kind"]) if row["kind"] and row["run"] else None
    query = dict(request.query_params)
    return looked(console, request, None if parts is None else parts.look(row, request.path_params["tab"], query))


def model_of(console: Console, request: Request) -> tuple[Model, dict[str, Any]]:
    """Return the model that an address names, and its row."""
    try:
        model = console.workspace.model(request.path_params["name"])
    except WorkspaceError as error:
        raise WebError(404, "no_such_model", _gone(console, request.path_params["name"]) or str(error)) from error
    try:
        return model, console.index.row(model.name)
    except UserInputError:
        console.watcher.refresh()  # a folder that has just been made
        return model, console.index.row(model.name)


def _gone(console: Console, name: str) -> str:
    """Return what happened to a model whose folder is gone; "" where no model had this name."""
    console.watcher.refresh()
    with contextlib.suppress(WorkspaceError):
        row = console.index.row(name)
        return str(row["reason"]) if row["status"] == GONE else ""
    return ""


def frame(row: Mapping[str, Any], here: str, parts: WorldParts | None) -> dict[str, Any]:
    """Return what the head of each of a model's pages shows."""
    more = parts.tabs(row) if parts is not None and row["run"] else []
    tabs = [("Overview", ""), *more, *(TABS if row["run"] else TABS[-1:])]
    return {
        "row": dict(row),
        "origin": _origin(row["cloned_from"]),
        "tabs": [(label, address(row["name"], below)) for label, below in tabs],
        "here": here,
        "path": address(row["name"]),
        "changes": parts is not None and row["run"] and parts.steps({}) and Path(row["path"]).parent.name != RUNS,
        "races": parts is not None and row["status"] == READY and parts.race_making() is not None,
    }


def _origin(cloned_from: str) -> str:
    """Return whose weights a model began with, for the line under its name; "": nobody's."""
    name, _, number = cloned_from.partition(":")
    return f"cloned from {name}, {checkpoint_text(number or 'best')}" if name else ""


def _stage(row: Mapping[str, Any], parts: WorldParts | None) -> dict[str, Any]:
    """Return what a world shows moving, once there is a run."""
    has_stage = parts is not None and row["run"] and row["status"] != ERROR
    return {
        "from": address(row["name"], "/watch/"),
        "stage": parts.stage if parts is not None and has_stage else "",
        "stage_modules": list(parts.stage_modules) if parts is not None and has_stage else [],
        "stage_styles": list(parts.stage_styles) if parts is not None and has_stage else [],
    }


def _counts(row: Mapping[str, Any]) -> list[Figure]:
    """Return the large numbers that every training has."""
    seconds, speed = int(row["seconds"]), row["speed"]
    ends = {kind: float(amount) for kind, _, amount in (stop.partition("=") for stop in row["stops"]) if amount}
    until = f"of {ends['minutes']:g} min" if "minutes" in ends else ""
    of = f" of {ends['steps']:,.0f}" if "steps" in ends else ""
    return [
        Figure(value=f"{row['iterations']:,}", label=f"iterations, {row['steps']:,}{of} steps"),
        Figure(value="–" if not speed else f"{speed:,.0f}", label="steps a second"),
        Figure(value=f"{seconds // 60}:{seconds % 60:02}", unit=until, label="trained"),
    ]


def _metrics(run: RunFolder | None) -> list[dict[str, Any]]:
    try:
        return run.read_metrics() if run is not None else []
    except RacecraftError:
        return []  # the row says what is wrong


def _sentence(run: RunFolder | None, metrics: list[dict[str, Any]], live: bool) -> str:
    """Return what came of a run in a few sentences; "" while nothing did."""
    if run is None or not metrics or live:
        return ""
    from racecraft.analysis.run_facts import read_facts
    from racecraft.analysis.run_summary import happened_words

    try:
        return happened_words(read_facts(run))
    except RacecraftError:
        return ""


def _log(console: Console, row: Mapping[str, Any], run: RunFolder | None) -> list[str]:
    """Return the last lines of the run's log, or of its job's where the run did not begin."""
    places = [run.log] if run is not None else []
    places += [console.home.log(row["job"])] if row["job"] else []
    for place in places:
        try:
            with open(place, "rb") as file:
                size = file.seek(0, 2)
                file.seek(max(0, size - LOG_BYTES))
                lines = file.read().decode("utf-8", "replace").splitlines()
        except OSError:
            continue
        if lines:
            return list(deque(lines, LOG_LINES))
    return []


def _commands(console: Console, model: Model, row: Mapping[str, Any]) -> str:
    """Return the commands that do what the page's buttons do."""
    lines = [f"cd {shlex.quote(str(model.path))}"]
    if row["job"]:
        with contextlib.suppress(JobError):
            lines.append(f"racecraft {shlex.join(get(console.home.store(), row['job']).spec.command)}")
        if row["status"] in (TRAINING, STOPPING, QUEUED):
            lines.append(f"racecraft jobs stop {row['job']}")
    if row["run"]:
        run = shlex.quote(row["run"])
        lines += [f"racecraft watch {run}", f"racecraft evaluate {run}", f"racecraft report {run}"]
    return "\n".join(lines)


def _python(row: Mapping[str, Any]) -> str:
    if not row["run"]:
        return ""
    return f"import racecraft as rc\n\npolicy = rc.load_policy({row['run']!r})\n"


def stop(console: Console, request: Request, fields: Fields) -> str:
    """End a training after its iteration."""
    model, row = model_of(console, request)
    stop_training(console.home, model, row["job"] if row["status"] in (TRAINING, QUEUED, STOPPING) else "")
    console.watcher.refresh()
    return address(model.name)


def resume(console: Console, request: Request, fields: Fields) -> str:
    """Go on with a training that ended, for some minutes more."""
    model, row = model_of(console, request)
    if not row["job"]:
        raise JobError(
            "{name}: was trained by a command in a terminal; expected a training of the console's. "
            "Show as command tells how to go on with it, or clone it.",
            name=model.name,
        )
    minutes = float(one(fields, "minutes", "10").replace(",", ".") or 10) + row["seconds"] / 60.0
    submit.resume(console.home, console.home.store(), row["job"], (f"minutes={minutes:.2f}",))
    console.watcher.refresh()
    return address(model.name)


def write_note(console: Console, request: Request, fields: Fields) -> str | Page:
    """Write what people say of a model; where it changed since the form was loaded, show both."""
    model, row = model_of(console, request)
    note = model.note()
    mine = _tags_and_text(fields, "")
    began, now = _tags_and_text(fields, "began_"), (note.tags, note.text[:MAX_NOTE])
    if now not in (began, mine):
        return _changed_note(model, row, mine, note)
    model.write_note(replace(note, tags=mine[0], text=mine[1]))
    console.watcher.refresh()
    return address(model.name)


def _tags_and_text(fields: Fields, prefix: str) -> tuple[tuple[str, ...], str]:
    tags = {tag.strip()[:32] for tag in one(fields, f"{prefix}tags").split(",")} - {""}
    return tuple(sorted(tags)), one(fields, f"{prefix}text").replace("\r\n", "\n")[:MAX_NOTE]


def _changed_note(model: Model, row: Mapping[str, Any], mine: tuple[tuple[str, ...], str], note: Note) -> Page:
    """Return both versions of a note, with three ways on."""
    tags, text = mine
    data = {
        **frame(row, "Overview", parts_of(row["kind"]) if row["kind"] else None),
        "lines": side_by_side(f"Tags: {', '.join(tags)}\n{text}", f"Tags: {', '.join(note.tags)}\n{note.text}"),
        "changed": (model.path / MODEL_FILE).stat().st_mtime,
        "now_tags": ", ".join(note.tags),
        "now_text": note.text,
        "ways": [
            ("Keep both", ", ".join(sorted({*tags, *note.tags})), both_texts(text, note.text)),
            ("Keep mine", ", ".join(tags), text),
        ],
    }
    return Page("note_changed.html", model.name, data, status=409)


def rename(console: Console, request: Request, fields: Fields) -> str:
    """Give a model another name."""
    model, row = model_of(console, request)
    if row["status"] in (TRAINING, STOPPING, QUEUED):
        raise JobError(
            "{name}: is {row}; expected a model that rests. Stop it first.", name=model.name, row=row["status"]
        )
    renamed = console.workspace.rename(model, one(fields, "name").strip())
    console.index.forget(model.name)
    console.watcher.refresh()
    return address(renamed.name)


SECTION = Section(routes=routes)
