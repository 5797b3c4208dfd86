"""Create model, step by step: a draft that is kept after each change, and Create and train on every step."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from racecraft.console.drafts import Draft, DraftChangedError, DraftError, Drafts
from racecraft.console.form import Field, Step, read_fields
from racecraft.console.merge import side_by_side
from racecraft.console.model_row import QUEUED, STOPPING, TRAINING
from racecraft.console.pages.model import address
from racecraft.console.parts import WorldParts, parts_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, form_fields, looked, one, page_routes
from racecraft.console.training import begin_training, end_training
from racecraft.console.workspace import Model
from racecraft.contract.errors import SettingError, UserInputError
from racecraft.contract.kinds import kinds
from racecraft.formats.run_folder import RunFolder
from racecraft.web.answers import json_answer
from racecraft.web.errors import WebError

CREATE = "create"
"""What the button Create and train sends in place of a step."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of the form."""

    def begin(request: Request) -> Response:
        return RedirectResponse(begin_draft(console, request), 303)

    async def keep(request: Request) -> Response:
        fields = await form_fields(request)
        return await run_in_threadpool(keep_step, console, request, fields)

    def look(request: Request) -> Response:
        return look_at_step(console, request)

    return [
        Route("/drafts/new", begin),
        Route("/drafts/{id}/{step}/look", look),
        *page_routes(console, "/drafts/{id}/{step}", step_page),
        act_route(console, "/drafts/{id}/{step}", send_step),
        Route("/drafts/{id}/{step}/keep", keep, methods=["POST"]),
    ]


def makers() -> list[WorldParts]:
    """Return the worlds whose models can be made here."""
    found = [parts_of(kind.name) for kind in kinds()]
    return sorted((parts for parts in found if parts.steps({})), key=lambda parts: (not parts.lesson, parts.kind.title))


def begin_draft(console: Console, request: Request) -> str:
    """Begin a draft, of a model that is cloned where one is named, and return the address of its first step."""
    query = request.query_params
    if query.get("from"):
        draft = clone_draft(console, query["from"], query.get("checkpoint", ""), in_place=bool(query.get("in_place")))
    else:
        offered = makers()
        if not offered:
            raise SettingError("No installed world has a form; expected one that does. The command line trains them.")
        parts = parts_of(query["kind"]) if query.get("kind") else offered[0]
        fields = {field.name for step in parts.steps({}) for field in step.fields}
        typed = {name: value for name, value in query.items() if name in fields}
        draft = _drafts(console).begin(parts.kind.name, console.workspace.free(f"my-{parts.noun}"), typed=typed)
    return _at(draft, parts_of(draft.kind).steps({})[0].key)


def clone_draft(
    console: Console,
    name: str,
    checkpoint: str = "",
    in_place: bool = False,
    typed: Mapping[str, Any] = MappingProxyType({}),
) -> Draft:
    """Return a new draft that begins with the values and weights of a model.

    Args:
        console: Whose.
        name: The model.
        checkpoint: Its weights are those of an iteration; "": the best, or of a model that goes on the last.
        in_place: Whether the model itself goes on, changed.
        typed: What is chosen otherwise already.

    Raises:
        UserInputError: There is no such model, or none that can be cloned so.
    """
    model = console.workspace.model(name)
    row = console.index.row(model.name)
    if not row["run"]:
        raise SettingError("{name}: was never trained; expected a model with a training to clone.", name=model.name)
    if in_place and model.is_run:
        raise SettingError(
            "{name}: was begun by a command, so its folder is one training; expected a model of the console. Clone it.",
            name=model.name,
        )
    base = parts_of(row["kind"]).values_of(RunFolder(Path(row["run"])))
    new = model.name if in_place else console.workspace.free(model.name)
    return _drafts(console).begin(row["kind"], new, base, _source(model.name, checkpoint), typed, in_place)


def step_page(console: Console, request: Request) -> Page:
    """Return one step of the form."""
    draft = _draft(console, request)
    return _page(draft, request.path_params["step"], [])


def send_step(console: Console, request: Request, fields: Fields) -> str | Page:
    """Keep what was typed in a step; go to another one, or make the model and train it."""
    draft, key = _draft(console, request), request.path_params["step"]
    steps = parts_of(draft.kind).steps(draft.typed)
    step = _step(steps, key)
    try:
        draft = _kept(console, draft, step, fields)
    except DraftChangedError as error:
        mine = replace(draft, typed={**draft.typed, **_typed(step, fields)})
        return _page(mine, key, [f"{error} Yours stands below; sent once more, it is kept."], 409, error.others)
    go = one(fields, "go")
    if go != CREATE:
        return _at(draft, go if go in {step.key for step in steps} else key)
    try:
        return _create(console, draft)
    except _WrongFieldsError as error:
        return _page(draft, error.step, [], 422)
    except UserInputError as error:
        return _page(draft, key, [str(error)], 422)


def keep_step(console: Console, request: Request, fields: Fields) -> Response:
    """Keep what is being typed and say what is wrong with it."""
    draft, key = _draft(console, request), request.path_params["step"]
    parts = parts_of(draft.kind)
    try:
        draft = _kept(console, draft, _step(parts.steps(draft.typed), key), fields)
    except DraftChangedError as error:
        message = f"{error} Choose a step or Create and train to see both."
        return json_answer({"error": "changed", "message": message}, 409)
    values, wrong = read_fields(parts.steps(draft.typed), draft.typed)
    return json_answer({"edits": draft.edits, "wrong": wrong, "remarks": parts.remarks(values)})


def look_at_step(console: Console, request: Request) -> Response:
    """Return a closer look at what was chosen in a step."""
    draft, key = _draft(console, request), request.path_params["step"]
    parts = parts_of(draft.kind)
    values, _ = read_fields(parts.steps(draft.typed), draft.typed)
    look = parts.look_ahead(key, {**parts.defaults(), **values}, dict(request.query_params))
    return looked(console, request, look)


class _WrongFieldsError(Exception):
    """Some fields cannot be used."""

    def __init__(self, step: str) -> None:
        super().__init__(step)
        self.step = step


def _create(console: Console, draft: Draft) -> str:
    """Make the model of a draft and put its training into the queue."""
    parts = parts_of(draft.kind)
    steps = parts.steps(draft.typed)
    values, wrong = read_fields(steps, draft.typed)
    if wrong:
        raise _WrongFieldsError(next(step.key for step in steps if any(field.name in wrong for field in step.fields)))
    values = {**draft.base, **values}  # what the form does not ask for stays as in the model that is cloned
    if draft.cloned_from and values.get("weights", True):
        source, _, checkpoint = draft.cloned_from.partition(":")
        row = console.index.row(console.workspace.model(source).name)
        values["from"] = f"{row['run']}:{checkpoint or ('last' if draft.in_place else 'best')}"
        parts.require_same_body(values, read_fields(steps, draft.base)[0])
    files = parts.files(values)
    if draft.in_place:
        model = _gone_on(console, draft, files)
    else:
        source = draft.cloned_from if "from" in values else ""
        model = console.workspace.create(draft.name, files, replace(parts.note(values), cloned_from=source))
    begin_training(console.home, model, parts.words(values))
    _drafts(console).remove(draft)
    console.watcher.refresh()
    return address(model.name)


def _gone_on(console: Console, draft: Draft, files: Mapping[str, str]) -> Model:
    """Return the model that goes on itself: its training is ended, and the next one reads these files."""
    model = console.workspace.model(draft.name)
    row = console.index.row(model.name)
    if row["status"] in (TRAINING, QUEUED, STOPPING):
        end_training(console.home, model, row["job"])
    model.write_files(files)
    return model


def _source(model: str, checkpoint: str) -> str:
    """Return what is cloned, as "NAME" or "NAME:12"."""
    return f"{model}:{checkpoint}" if checkpoint.isdigit() else model


def _page(
    draft: Draft, key: str, messages: list[str], status: int = 200, others: Mapping[str, Any] = MappingProxyType({})
) -> Page:
    parts = parts_of(draft.kind)
    steps = parts.steps(draft.typed)
    step = _step(steps, key)
    values, wrong = read_fields(steps, draft.typed)
    keys = [one.key for one in steps]
    at = keys.index(step.key)
    return Page(
        "create.html",
        f"{step.title}: {draft.name}",
        {
            "draft": asdict(draft),
            "in_place": draft.in_place,
            "writer": secrets.token_hex(8),
            "steps": [
                {"key": one.key, "title": one.title, "wrong": sum(field.name in wrong for field in one.fields)}
                for one in steps
            ],
            "step": {"key": step.key, "title": step.title, "lead": step.lead, "data": step.data or {}},
            "fields": [_field(field, draft, wrong) for field in step.fields],
            "step_template": step.template,
            "step_modules": list(step.modules),
            "stage_styles": list(step.styles),
            "next": keys[at + 1] if at + 1 < len(keys) else "",
            "messages": messages,
            "others": [
                {
                    "label": field.label,
                    "lines": side_by_side(str(draft.typed[field.name]), str(others[field.name])),
                }
                for field in step.fields
                if field.name in others
            ],
            "summary": parts.summary({**parts.defaults(), **values}),
            "remarks": parts.remarks(values),
            "makers": [(one.kind.title, f"/drafts/new?kind={one.kind.name}") for one in makers()],
            "kind_title": parts.kind.title,
            "path": f"/drafts/{draft.id}/{step.key}",
        },
        status=status,
    )


def _field(field: Field, draft: Draft, wrong: Mapping[str, str]) -> dict[str, Any]:
    """Return a field as the page draws it: what was typed, what is wrong, what it was in the cloned model."""
    typed = draft.typed.get(field.name, field.default)
    was = draft.base.get(field.name, field.default) if draft.base else None
    is_changed = draft.base and str(was) != str(typed)
    return {
        **{name: getattr(field, name) for name in ("name", "label", "kind", "unit", "sentence", "matters")},
        "value": typed in (True, "on", "1", "true") if field.kind == "switch" else typed,
        "choices": [list(choice) for choice in field.choices],
        "names": [list(name) for name in field.names],
        "wrong": wrong.get(field.name, ""),
        "was": (str(was) if len(str(was)) < 40 else "another text") if is_changed else None,
    }


def _kept(console: Console, draft: Draft, step: Step, fields: Fields) -> Draft:
    """Return the draft with what a step's form sent; a switch that is off is not sent at all."""
    edits = one(fields, "edits", "0")
    return _drafts(console).keep(
        draft,
        int(edits) if edits.isdigit() else 0,
        one(fields, "writer"),
        one(fields, "name", draft.name).strip(),
        _typed(step, fields),
    )


def _typed(step: Step, fields: Fields) -> dict[str, Any]:
    typed: dict[str, Any] = {}
    for field in step.fields:
        if field.kind == "switch":
            typed[field.name] = one(fields, field.name) in ("on", "1", "true")
        elif field.name in fields:
            typed[field.name] = one(fields, field.name).replace("\r\n", "\n")
    return typed


def _draft(console: Console, request: Request) -> Draft:
    try:
        return _drafts(console).find(request.path_params["id"])
    except DraftError as error:
        raise WebError(404, "no_such_draft", str(error)) from error


def _step(steps: list[Step], key: str) -> Step:
    for step in steps:
        if step.key == key:
            return step
    raise WebError(404, "no_such_step", f"There is no step {key[:40]!r}; begin at {steps[0].key}.")


def _drafts(console: Console) -> Drafts:
    return Drafts(console.workspace.path / "drafts")


def _at(draft: Draft, step: str) -> str:
    return f"/drafts/{draft.id}/{step}"


SECTION = Section(routes=routes)
