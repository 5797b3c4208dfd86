"""Models that people share: others take a copy into their own workspace, and see nothing else."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from starlette.requests import Request
from starlette.routing import BaseRoute

from racecraft.accounts.people import LOCAL_OWNER, Person, Role
from racecraft.console.pages.model import address, model_of
from racecraft.console.personal import workspace_of
from racecraft.console.run_row import read_run
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, one, page_routes, person_of
from racecraft.console.workspace import Model, Note, Workspace
from racecraft.contract.errors import SettingError
from racecraft.formats.run_lock import LOCK, holder
from racecraft.web.errors import WebError


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of sharing."""
    return [
        *page_routes(console, "/shared", shared_page),
        act_route(console, "/shared/copy", copy),
        act_route(console, "/models/{name}/share", share),
    ]


def shared_page(console: Console, request: Request) -> Page:
    """Return what others share."""
    models = []
    for whose, model, note in _shared(console, person_of(request)):
        runs = model.runs()
        row = read_run(runs[-1], "") if runs else None
        models.append(
            {
                "owner": whose.owned,
                "owner_name": whose.name,
                "name": model.name,
                "place": row.place if row else note.place,
                "best": row.best_text if row else "",
                "text": note.text.partition("\n")[0],
            }
        )
    return Page("shared.html", "Shared", {"models": models})


def share(console: Console, request: Request, fields: Fields) -> str:
    """Begin or end to share a model."""
    model, _ = model_of(console, request)
    model.write_note(replace(model.note(), shared=one(fields, "shared") == "1"))
    return address(model.name)


def copy(console: Console, request: Request, fields: Fields) -> str:
    """Copy a shared model into the workspace of whoever asks."""
    owner, name = one(fields, "owner"), one(fields, "name")
    found = [
        (whose, model, note)
        for whose, model, note in _shared(console, person_of(request))
        if (whose.owned, model.name) == (owner, name)
    ]
    if not found:
        raise WebError(404, "not_shared", "Nobody shares such a model; load the page again.")
    whose, model, note = found[0]
    if any(holder(run) is not None for run in model.runs()):
        raise SettingError("{name}: is training; expected a model that rests. Try again later.", name=model.name)
    made = console.workspace.create(console.workspace.free(model.name), {})
    target = made.path / "runs" / model.name if model.is_run else made.path
    shutil.copytree(model.path, target, ignore=_left_out, dirs_exist_ok=True)
    text = "\n".join([f"Copied from {whose.name}'s {model.name}.", note.text]).strip()
    made.write_note(replace(note, shared=False, archived=False, tags=(), text=text, created=time.time()))
    console.watcher.refresh()
    return address(made.name)


def _shared(console: Console, person: Person) -> Iterator[tuple[Person, Model, Note]]:
    """Yield the models that others share: the owner's first, then by person and name."""
    assert console.accounts is not None
    root = console.shared or console.workspace.path
    others = [LOCAL_OWNER, *(one for one in console.accounts.people() if one.role is not Role.OWNER)]
    for whose in others:
        if whose.owned == person.owned:
            continue
        for model in Workspace(workspace_of(root, whose)).models():
            note = model.note()
            if note.shared and not note.archived:
                yield whose, model, note


def _left_out(folder: str, names: list[str]) -> set[str]:
    """Return what of a folder is not copied: links, which may lead elsewhere, pipes, and locks."""
    return {name for name in names if name == LOCK or not _is_plain(Path(folder) / name)}


def _is_plain(path: Path) -> bool:
    return not os.path.islink(path) and (path.is_file() or path.is_dir())


SECTION = Section(routes=routes)
