"""What is dropped on any page: another program's model becomes a model here, a log or trace alone shows its laps."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path
from urllib.parse import quote

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import FileResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Route

from racecraft.console.commands import CommandError, run_command
from racecraft.console.pages.kept import ALONE
from racecraft.console.pages.model import address
from racecraft.console.parts import parts_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Page, form_with_file, in_frame, page_routes
from racecraft.console.workspace import LOGS, Note
from racecraft.contract.errors import SettingError
from racecraft.contract.kinds import kinds
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.web.errors import WebError

UPLOADS = "uploads"
PIECE = 2**20
LAPS = "laps.html"
"""The page about a log that came without a model."""
NO_MODEL = "no-model.txt"
"""Beside it: why what came with the log is no model."""
LONGEST_NAME = 60
"""Letters of a model's name that are taken from its file's; a number may follow."""
ENDS_OF_LOGS = (".csv", ".log", ".txt", ".jsonl", ".json")
"""Files that hold no weights."""


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
        return _logged(console, place, file)
    try:
        return _imported(console, place, file)
    except CommandError as no_model:
        try:
            return _logged(console, place, file, str(no_model).replace(str(place), file))
        except CommandError:
            raise no_model from None


def _logged(console: Console, place: Path, file: str, no_model: str = "") -> str:
    """Keep a log, the page about its laps and why it is no model, or nothing."""
    folder = console.workspace.free_folder(LOGS, file)
    folder.mkdir(parents=True)
    try:
        log = Path(shutil.copy(place, folder / file))
        run_command(_log_words(log, folder / LAPS), folder)
        if no_model:
            (folder / NO_MODEL).write_text(no_model, encoding="utf-8")
    except CommandError:
        shutil.rmtree(folder)
        raise
    return f"/logs/{quote(folder.name)}"


def _log_words(log: Path, page: Path) -> list[str]:
    for kind in kinds():
        if words := parts_of(kind.name).log_words(log, page):
            return words
    raise CommandError("No installed world reads logs; expected DeepRacer.")


def log_page(console: Console, request: Request) -> Page:
    """Return where a log lies that came without a model, and the way to its laps."""
    name = _log_of(console, request)
    folder = console.workspace.path / LOGS / name
    file = next(path for path in folder.iterdir() if path.name not in (LAPS, NO_MODEL))
    no_model = (folder / NO_MODEL).read_text(encoding="utf-8") if (folder / NO_MODEL).is_file() else ""
    words = shlex.join(_log_words(file, folder / LAPS))
    return Page(
        "log.html", name, {"name": name, "file": str(file), "no_model": no_model, "command": f"racecraft {words}"}
    )


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
    name = re.sub(r"(\.tar)?\.(gz|bz2|zip|tar|tgz|pb)$", "", file)[:LONGEST_NAME].strip("-._+ ")
    name = console.workspace.free(name or "imported")
    model = console.workspace.create(name, {}, Note())
    try:
        result = run_command(_import_command(place, model.path / model.next_run()), model.path)
    except CommandError:
        shutil.rmtree(model.path)
        raise
    notes = [f"Imported from {file}.", *(f"- {note}" for note in result.get("notes", ()))]
    model.write_note(Note(tags=("imported",), text="\n".join(notes)))
    console.watcher.refresh()
    return f"/import/{model.name}"


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
    holds, missing = _held(RunFolder(Path(row["run"]))) if row["run"] else ([], [])
    data = {"row": row, "holds": holds, "missing": missing, "notes": row["text"].splitlines()}
    return Page("imported.html", model.name, {**data, "path": address(model.name)})


def _held(run: RunFolder) -> tuple[list[str], list[str]]:
    """Return what a run holds of a model, and what it lacks."""
    files = {"reward function": run.reward_function, "hyperparameters": run.hyperparameters}
    missing = [name for name, file in files.items() if not file.is_file()]
    count = len(Checkpoints(run.checkpoints).entries())
    kept = f"{count} checkpoint" if count == 1 else f"{count} checkpoints"
    return [kept, *(name for name in files if name not in missing)], missing


SECTION = Section(routes=routes)
