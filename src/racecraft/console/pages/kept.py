"""What a model's newest training left: its checkpoints, evaluations and files, and files for other programs."""

from __future__ import annotations

import json
import shutil
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route

from racecraft.analysis.evaluations import return_table
from racecraft.console.disk_use import bytes_in
from racecraft.console.model_row import QUEUED, STOPPING, TRAINING
from racecraft.console.pages.model import address, frame, model_of
from racecraft.console.paging import page_of
from racecraft.console.parts import parts_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, one, page_routes
from racecraft.console.verdicts import JUDGING, begin_judging, kept_verdict
from racecraft.contract.errors import SettingError
from racecraft.formats.checkpoint_ranking import MERITS, ranked
from racecraft.formats.run_folder import RunFolder
from racecraft.web.errors import WebError

ALONE = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline' data:; style-src 'unsafe-inline'; "
    "img-src data: blob:; media-src data: blob:; font-src data:; frame-ancestors 'none'"
)
"""What a page that lies in a run may do: nothing but show itself, in an origin of its own."""
EVALUATE = "evaluate"
KEPT = 10
"""Checkpoints besides the best and the last two that the form offers to keep."""
EXPORTING = "Exporting"
REPORT, REPORT_PAGE = "report", "report.html"
LOGGED = ("log.txt", "metrics.jsonl", "logs", "metrics", "training-simtrace", "evaluation-simtrace")
"""Files and folders of a run that tell how it went."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of checkpoints, evaluations and files."""

    def download(request: Request) -> Response:
        return file_answer(console, request)

    def logs(request: Request) -> Response:
        return logs_answer(console, request)

    def view(request: Request) -> Response:
        return page_of_run(console, request)

    return [
        *page_routes(console, "/models/{name}/checkpoints", checkpoints_page),
        act_route(console, "/models/{name}/checkpoints", prune),
        *page_routes(console, "/models/{name}/evaluations", evaluations_page),
        act_route(console, "/models/{name}/evaluations", evaluate),
        *page_routes(console, "/models/{name}/files", files_page),
        act_route(console, "/models/{name}/export", export),
        Route("/models/{name}/logs.zip", logs),
        Route("/models/{name}/files/{path:path}", download),
        Route("/models/{name}/view/{path:path}", view),
    ]


def checkpoints_page(console: Console, request: Request) -> Page:
    """Return the checkpoints, the best first."""
    row, run = _run_of(console, request)
    by = request.query_params.get("by", "progress")
    best = ranked(run, by)
    return _page(
        row,
        "Checkpoints",
        "checkpoints.html",
        {
            "by": by,
            "kept": KEPT,
            "merits": [(name, words) for name, (words, _) in MERITS.items()],
            "checkpoints": [
                {
                    "iteration": one.entry.iteration,
                    "steps": one.entry.steps,
                    "score": one.score,
                    "lap": one.best_lap_seconds,
                    "mean_lap": one.mean_lap_seconds,
                    "worst": one.worst_progress_percent,
                }
                for one in best
            ],
            "score_name": parts_of(row["kind"]).kind.score.short,
            "bytes": bytes_in(run.checkpoints),
            "rests": row["status"] not in (TRAINING, STOPPING, QUEUED),
            "command": f"racecraft checkpoints {row['run']} --by {by}\n"
            f"racecraft checkpoints {row['run']} --keep best,last,{KEPT}",
        },
    )


def prune(console: Console, request: Request, fields: Fields) -> str:
    """Take checkpoints away but for the best, the last two and as many as the form says; the name confirms it."""
    from racecraft.actions.checkpoints import checkpoints

    row, run = _run_of(console, request)
    if one(fields, "confirm").strip() != row["name"]:
        raise SettingError(
            "Name of the model: found {found!r}; expected {name!r}. What is taken away does not come back.",
            found=one(fields, "confirm")[:64], name=row["name"],
        )  # fmt: skip
    checkpoints(str(run.path), keep=f"best,last,{one(fields, 'kept', '0').strip()}")
    console.watcher.refresh()
    return address(row["name"], "/checkpoints")


def evaluations_page(console: Console, request: Request) -> Page:
    """Return every evaluation of the newest training, the latest first."""
    row, run = _run_of(console, request)
    paths = [path for path in run.evaluations.glob("*.json") if path.stem.isdigit()]
    where = address(row["name"], "/evaluations")
    page = page_of(where, request.query_params, paths, lambda one: (-float(one.stem), ""))
    found = [
        {"iteration": int(path.stem), **json.loads(path.read_text(encoding="utf-8"))} for path in reversed(page.rows)
    ]
    table_of = parts_of(row["kind"]).kind.piece("evaluation_table") or return_table
    table = table_of(found) if found else None
    return _page(
        row,
        "Evaluations",
        "evaluations.html",
        {
            "words": "" if table is None else table.description,
            "heads": [] if table is None else list(table.heads),
            "lines": [] if table is None else [list(map(str, line)) for line in table.rows],
            "pages": page.links,
            "command": f"racecraft evaluate {row['run']}",
            "verdict": kept_verdict(console, EVALUATE, [row]) or {},
            "task": console.tasks.of(row["name"], JUDGING),
        },
    )


def evaluate(console: Console, request: Request, fields: Fields) -> str:
    """Begin to judge the best checkpoint on fresh starts."""
    row, run = _run_of(console, request)
    begin_judging(console, row["name"], [EVALUATE, str(run.path)], [row])
    return address(row["name"], "/evaluations")


def files_page(console: Console, request: Request) -> Page:
    """Return the files of the model, the newest first, and what it can be exported to."""
    model, row = model_of(console, request)
    root = model.path
    paths = [path for path in root.rglob("*") if path.is_file() and not path.is_symlink()]
    found = [(str(path.relative_to(root)), path.stat()) for path in paths]
    where = address(model.name, "/files")
    page = page_of(where, request.query_params, found, lambda one: (-one[1].st_mtime, one[0]))
    kind = parts_of(row["kind"]).kind if row["kind"] and row["run"] else None
    refusal = kind.piece("export_refusal") if kind is not None else None
    report = Path(row["run"]) / REPORT_PAGE if row["run"] else None
    task = console.tasks.of(row["name"], EXPORTING)
    data = {
        "task": task,
        "files": [{"path": path, "bytes": stat.st_size, "changed": stat.st_mtime} for path, stat in page.rows],
        "pages": page.links,
        "count": len(found),
        "bytes": sum(stat.st_size for _, stat in found),
        "exporters": sorted(kind.exporters) if kind is not None else [],
        "no_export": refusal(RunFolder(Path(row["run"]))) if refusal else "",
        "instead": kind.export_instead if kind is not None and not kind.exporters else "",
        "report": REPORT_PAGE if report is not None and report.is_file() else "",
    }
    return _page(row, "Files", "files.html", data)


def export(console: Console, request: Request, fields: Fields) -> str:
    """Begin to write the best checkpoint for another program, or a report; it is among the model's files then."""
    row, run = _run_of(console, request)
    to = one(fields, "to")
    if to == REPORT:
        console.tasks.begin(row["name"], EXPORTING, [REPORT, str(run.path)], console.workspace.path)
        return address(row["name"], "/files")
    if to not in parts_of(row["kind"]).kind.exporters:
        raise SettingError("{to!r}: is no program to export to.", to=to[:20])
    console.tasks.begin(row["name"], EXPORTING, ["export", str(run.path), "--to", to], console.workspace.path)
    return address(row["name"], "/files")


def file_answer(console: Console, request: Request) -> Response:
    """Return one of the model's files to be saved; nothing outside its folder, and no link, is reached."""
    model, _ = model_of(console, request)
    path = _inside(model.path, request.path_params["path"])
    return FileResponse(path, filename=path.name, content_disposition_type="attachment")


def logs_answer(console: Console, request: Request) -> Response:
    """Return what the newest training logged, as a zip that can be dropped on a console."""
    model, run = _run_of(console, request)
    folder = Path(tempfile.mkdtemp(prefix="racecraft-"))
    with zipfile.ZipFile(folder / "logs.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for name in LOGGED:
            place = run.path / name
            for path in sorted(place.rglob("*")) if place.is_dir() else [place]:
                if path.is_file() and not path.is_symlink():
                    archive.write(path, path.relative_to(run.path))
    tidy = BackgroundTask(shutil.rmtree, folder, True)
    return FileResponse(folder / "logs.zip", filename=f"{model['name']}-logs.zip", background=tidy)


def page_of_run(console: Console, request: Request) -> Response:
    """Return a page that a command wrote into the newest training; it can do nothing in the console's name."""
    _, run = _run_of(console, request)
    path = _inside(run.path, request.path_params["path"])
    if path.suffix != ".html":
        raise WebError(404, "no_page", f"{path.name[:80]}: is no page; expected one that ends in .html.")
    return FileResponse(path, media_type="text/html", headers={"Content-Security-Policy": ALONE})


def _inside(root: Path, name: str) -> Path:
    """Return a file in a folder.

    Raises:
        WebError: There is none of that name, or it lies elsewhere.
    """
    root = root.resolve()
    try:
        path = (root / name).resolve()
        is_there = path.is_relative_to(root) and path.is_file()
    except (OSError, ValueError):  # a name no file can have
        is_there = False
    if not is_there:
        raise WebError(404, "no_such_file", "There is no such file in this model.")
    return path


def _run_of(console: Console, request: Request) -> tuple[dict[str, Any], RunFolder]:
    _, row = model_of(console, request)
    if not row["run"]:
        reason = row["reason"] or f"{row['name']} has no training yet; expected one that has begun."
        raise WebError(404, "no_run", reason)
    return row, RunFolder.open(Path(row["run"]))


def _page(row: Mapping[str, Any], here: str, template: str, data: Mapping[str, Any]) -> Page:
    parts = parts_of(row["kind"]) if row["kind"] else None
    return Page(template, f"{here}: {row['name']}", {**frame(row, here, parts), **data})


SECTION = Section(routes=routes)
