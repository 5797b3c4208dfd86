"""What is dropped on any page: a model or its files without weights become a model; a log alone has a page."""

from __future__ import annotations

import contextlib
import json
import re
import shlex
import shutil
import time
from dataclasses import asdict, replace
from pathlib import Path
from urllib.parse import quote

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import FileResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from racecraft.console.commands import CommandError, run_command
from racecraft.console.form import read_fields
from racecraft.console.pages.kept import ALONE
from racecraft.console.pages.model import address
from racecraft.console.parts import parts_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, form_with_file, in_frame, one, page_routes
from racecraft.console.training import begin_training
from racecraft.console.workspace import LOGS, MODELS, Model, Note
from racecraft.contract.errors import SettingError
from racecraft.contract.kinds import kinds
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.web.errors import WebError

UPLOADS = "uploads"
PIECE = 2**20
LAPS = "laps.html"
"""The page about a log that came without a model."""
ABOUT_LOG = "page.json"
"""Beside it: the command that wrote it, and why the log is no model or has no better page."""
LONGEST_NAME = 60
"""Letters of a model's name that are taken from its file's; a number may follow."""
ENDS_OF_LOGS = (".csv", ".log", ".txt", ".jsonl", ".json")
"""Files that hold no weights."""
NO_WEIGHTS = "NoWeightsError"
"""With this kind of error an import refuses a model's files without weights."""
CHOSEN = ("track", "minutes")
"""Fields of a world's form that a training of such files needs; the files hold the rest."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of imports."""

    async def take(request: Request) -> Response:
        async with form_with_file(request, "archive") as (_, archive):
            if archive is None:
                raise SettingError("Import: found no file; expected an archive, such as model.tar.gz.")
            answer = await run_in_threadpool(take_in, console, archive)
        if isinstance(answer, str):
            return RedirectResponse(answer, 303)
        return await run_in_threadpool(in_frame, console, request, answer)

    def laps(request: Request) -> Response:
        page = console.workspace.path / LOGS / _log_of(console, request) / LAPS
        return FileResponse(page, media_type="text/html", headers={"Content-Security-Policy": ALONE})

    return [
        *page_routes(console, "/logs/{name}", log_page),
        Route("/logs/{name}/laps", laps),
        *page_routes(console, "/import", import_page),
        Route("/import", take, methods=["POST"]),
        *page_routes(console, "/import/{name}", imported_page),
        act_route(console, "/import/{name}/train", train),
    ]


def import_page(console: Console, request: Request) -> Page:
    """Return the form of an import."""
    return Page("import.html", "Import", {"wrong": "", "file": ""})


def take_in(console: Console, archive: UploadFile) -> str | Page:
    """Make a model of an archive; what cannot be used is said on the form."""
    file = re.sub(r"[^\w.+-]+", "-", Path(str(archive.filename)).name)[-80:] or "model"
    place = console.workspace.path / UPLOADS / file
    place.parent.mkdir(exist_ok=True)
    try:
        with open(place, "wb") as out:
            shutil.copyfileobj(archive.file, out, PIECE)
        return _taken(console, place, file)
    except CommandError as error:
        return Page("import.html", "Import", {"wrong": str(error).replace(str(place), file), "file": file}, status=422)
    finally:
        place.unlink(missing_ok=True)


def _taken(console: Console, place: Path, file: str) -> str:
    """Make a model of a file, or where it holds none the page of a log."""
    if place.suffix.lower() in ENDS_OF_LOGS:
        return f"/logs/{quote(_logged(console, place, file))}"
    if place.suffix.lower() == ".py":
        return _taken_anew(console, place, file)
    try:
        return _imported(console, place, file)
    except CommandError as no_model:
        if no_model.kind == NO_WEIGHTS:
            with contextlib.suppress(CommandError):
                return _taken_anew(console, place, file)
        try:
            return f"/logs/{quote(_logged(console, place, file, str(no_model).replace(str(place), file)))}"
        except CommandError:
            raise no_model from None


def _logged(console: Console, place: Path, file: str, no_model: str = "") -> str:
    """Keep a log with the page about it, or nothing; return its name."""
    folder = console.workspace.free_folder(LOGS, file.removesuffix(".json"))  # which ends addresses of a page's data
    folder.mkdir(parents=True)
    try:
        log = Path(shutil.copy(place, folder / file))
        words, reasons = _write_page(log, folder / LAPS)
    except CommandError:
        shutil.rmtree(folder)
        raise
    reasons = [*([no_model] if no_model else []), *(reason.replace(str(log), file) for reason in reasons)]
    (folder / ABOUT_LOG).write_text(json.dumps({"words": words, "reasons": reasons}), encoding="utf-8")
    return folder.name


def _write_page(log: Path, page: Path) -> tuple[list[str], list[str]]:
    """Write the page about a log; return the command that did, and why those before it could not.

    Raises:
        CommandError: None of them can; the first one's reason.
    """
    refused: list[CommandError] = []
    for words in (words for kind in kinds() for words in parts_of(kind.name).log_words(log, page)):
        try:
            run_command(words, log.parent)
            if page.is_file():
                return words, [str(error) for error in refused]
        except CommandError as error:
            refused.append(error)
    raise refused[0] if refused else CommandError("No installed world reads logs; expected DeepRacer.")


def log_page(console: Console, request: Request) -> Page:
    """Return where a log lies that came without a model, and the way to its page."""
    name = _log_of(console, request)
    folder = console.workspace.path / LOGS / name
    file = next(path for path in folder.iterdir() if path.name not in (LAPS, ABOUT_LOG))
    about = json.loads((folder / ABOUT_LOG).read_text(encoding="utf-8"))
    command = f"racecraft {shlex.join(about['words'])}"
    return Page("log.html", name, {"name": name, "file": str(file), "reasons": about["reasons"], "command": command})


def _log_of(console: Console, request: Request) -> str:
    """Return the name of a log that is there.

    Raises:
        WebError: There is none of that name.
    """
    name: str = request.path_params["name"]
    logs = console.workspace.path / LOGS
    if name not in {path.parent.name for path in logs.glob(f"*/{LAPS}")}:
        raise WebError(404, "no_such_log", f"There is no log {name[:80]!r}; expected one that was dropped here.")
    return name


def _imported(console: Console, place: Path, file: str) -> str:
    model = console.workspace.create(_free_name(console, file), {}, Note())
    try:
        result = run_command(_import_command(place, model.path / model.next_run()), model.path)
    except CommandError:
        shutil.rmtree(model.path)
        raise
    notes = [f"Imported from {file}.", *(f"- {note}" for note in result.get("notes", ()))]
    model.write_note(Note(tags=("imported",), text="\n".join(notes)))
    console.watcher.refresh()
    return f"/import/{model.name}"


def _free_name(console: Console, file: str) -> str:
    """Return a name for the model of a file that no other model has."""
    name = re.sub(r"(\.tar)?\.(gz|bz2|zip|tar|tgz|pb|py)$", "", file)[:LONGEST_NAME].strip("-._+ ")
    return console.workspace.free(name or "imported")


def _taken_anew(console: Console, place: Path, file: str) -> str:
    """Make a model that was never trained of files without weights; logs among them have their page.

    Raises:
        CommandError: No world reads such files, or they cannot be used.
    """
    name = _free_name(console, file)
    model = Model(name, console.workspace.path / MODELS / name)
    parts = next((parts for kind in kinds() if (parts := parts_of(kind.name)).words_of_files(place, model.path)), None)
    if parts is None:
        raise CommandError("No installed world trains such files; expected DeepRacer.")
    result = run_command(parts.words_of_files(place, model.path), console.workspace.path)
    notes = [f"Read from {file}, which holds no weights.", *(f"- {note}" for note in result["notes"])]
    note = replace(parts.note({}), tags=("imported",), text="\n".join(notes), created=time.time())
    model.write_note(note)
    console.watcher.refresh()
    log = ""
    if result["has_logs"]:
        with contextlib.suppress(CommandError):
            log = _logged(console, place, file)
    return f"/import/{name}" + (f"?log={quote(log)}" if log else "")


def _import_command(place: Path, run: Path) -> list[str]:
    """Return the command that imports; the first world with one is asked."""
    for kind in kinds():
        if words := parts_of(kind.name).import_words(place, run):
            return words
    raise CommandError("No installed world imports models; expected DeepRacer.")


def imported_page(console: Console, request: Request) -> Page:
    """Return what an import brought, what is missing, and what can be done with it."""
    model = console.workspace.model(request.path_params["name"])
    row = console.index.row(model.name)
    run = RunFolder(Path(row["run"])) if row["run"] else None
    holds, missing = _held(run or RunFolder(model.path))
    is_new = run is None and not row["job"] and row["kind"]
    fields = [field for step in parts_of(row["kind"]).steps({}) for field in step.fields] if is_new else []
    data = {
        "row": row, "holds": holds, "missing": missing, "notes": row["text"].splitlines(),
        "fields": [asdict(field) for field in fields if field.name in CHOSEN],
        "log": request.query_params.get("log", ""),
    }  # fmt: skip
    return Page("imported.html", model.name, {**data, "path": address(model.name)})


def train(console: Console, request: Request, fields: Fields) -> str:
    """Train a model of files without weights, as they stand in its folder.

    Raises:
        SettingError: It was trained before, or a value cannot be used.
    """
    model = console.workspace.model(request.path_params["name"])
    row = console.index.row(model.name)
    if row["run"] or row["job"] or not row["kind"]:
        raise SettingError("{name}: has a training already; expected a model without one. Clone it.", name=model.name)
    parts = parts_of(row["kind"])
    values, wrong = read_fields(parts.steps({}), {name: one(fields, name) for name in CHOSEN if name in fields})
    if wrong:
        raise SettingError("{wrong}", wrong=" ".join(wrong.values()))
    begin_training(console.home, model, parts.words(values))
    console.watcher.refresh()
    return address(model.name)


def _held(run: RunFolder) -> tuple[list[str], list[str]]:
    """Return what a run, or a model's folder without one, holds of a model, and what it lacks."""
    files = {
        "reward function": run.reward_function, "metadata": run.model_metadata, "hyperparameters": run.hyperparameters
    }  # fmt: skip
    count = len(Checkpoints(run.checkpoints).entries()) if run.checkpoints.is_dir() else 0
    holds = {("1 checkpoint" if count == 1 else f"{count} checkpoints") if count else "weights": count > 0}
    holds |= {name: file.is_file() for name, file in files.items()}
    return [name for name, is_there in holds.items() if is_there], [name for name in holds if not holds[name]]


SECTION = Section(routes=routes)
