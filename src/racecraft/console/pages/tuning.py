"""Look for the settings that train best: choose what to vary, see what mattered, keep the best trial as a model.

A search is a job that runs `racecraft tune`; each of its trials is a job as well. Searches lie in `tunings/`.
"""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

import sqlalchemy as sql
from starlette.requests import Request
from starlette.routing import BaseRoute

from racecraft.analysis.tuning_page import plain
from racecraft.console.index_tables import MODELS
from racecraft.console.pages.model import address
from racecraft.console.paging import page_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, one, page_routes
from racecraft.console.training import job_name
from racecraft.console.tuning_form import CHECKED_FIRST, Offer, SearchForm, offers
from racecraft.console.workspace import TUNINGS
from racecraft.contract.errors import InputFileError, SettingError, UserInputError
from racecraft.formats.atomic import make_folder
from racecraft.formats.job_spec import JobSpec
from racecraft.formats.tuning import TrialRecord, TuningRecord, read_tuning
from racecraft.jobs.job import Job
from racecraft.jobs.store import get
from racecraft.jobs.submit import environment_here, request_stop, resume, submit_numbered
from racecraft.jobs.tuning.training_trials import TRIALS
from racecraft.pages.chart import Chart, Series
from racecraft.web.errors import WebError

MAX_CHARTS = 6
MEMORY_MIB = 512


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of searches."""
    return [
        *page_routes(console, "/tuning", tunings_page),
        *page_routes(console, "/tuning/new", form_page),
        act_route(console, "/tuning/new", begin),
        *page_routes(console, "/tuning/{name}", tuning_page),
        act_route(console, "/tuning/{name}/stop", stop),
        act_route(console, "/tuning/{name}/go-on", go_on),
        act_route(console, "/tuning/{name}/keep", keep),
    ]


def tunings_page(console: Console, request: Request) -> Page:
    """Return every search of the workspace, the newest first, and the models that one can begin with."""
    with_job = sql.select(MODELS.c.name).where(MODELS.c.job != "").order_by(MODELS.c.changed.desc())
    models = [row["name"] for row in console.index.query(with_job)]
    jobs = _jobs(console)
    page = page_of("/tuning", request.query_params, _folders(console), lambda one: (-one.stat().st_mtime, one.name))
    tunings = [_row(folder, jobs.get(str(folder))) for folder in page.rows]
    return Page(
        "tunings.html",
        "Tuning",
        {"tunings": tunings, "pages": page.links, "models": models},
        here="/jobs",
    )


def form_page(console: Console, request: Request) -> Page:
    """Return the form of a search for a model."""
    model = request.query_params.get("m", "")
    if not model:
        raise WebError(404, "no_such_model", "A search begins with a model; choose one at /tuning.")
    rows, _ = _offers(console, model)
    first = [offer.name for offer in rows if offer.name.rpartition(".")[2] in CHECKED_FIRST]
    form = SearchForm(model=model, chosen=tuple(first), ranges={offer.name: offer.range for offer in rows})
    return _form(console, form, "")


def begin(console: Console, request: Request, fields: Fields) -> str | Page:
    """Begin a search; what cannot be used is said beside what was typed."""
    form = SearchForm.of(fields)
    try:
        _, job = _offers(console, form.model)
        words = form.command(job.spec.command)
    except UserInputError as error:
        return _form(console, form, str(error), 422)
    folder = console.workspace.free_folder(TUNINGS, "1")
    command = ("tune", f"--run={folder}", *words)

    def spec(name: str) -> JobSpec:
        return JobSpec(
            command=command, name=name, folder=job.spec.folder, environment=environment_here(), cores=0,
            memory_mib=MEMORY_MIB, recorded={"tuning": str(folder), "model": form.model},
        )  # fmt: skip

    make_folder(folder)
    submit_numbered(console.home, f"{job_name(form.model)}-tuning", spec)
    console.watcher.refresh()
    return _address(folder)


def tuning_page(console: Console, request: Request) -> Page:
    """Return what a search has tried, what mattered, and its best trial."""
    folder, job = _search_of(console, request)
    record, fault = _read(folder)
    data = {
        **_row(folder, job),
        "fault_of_file": fault,
        "charts": [(chart.title, chart.shown()) for chart in _charts(record, job)] if record else [],
        "shares": record.shares if record else [],
        "table": _table(record, folder),
        "commands": {"command": _command(job, record, folder), "python": ""},
    }
    return Page("tuning.html", f"Tuning {folder.name}", data, here="/jobs")


def stop(console: Console, request: Request, fields: Fields) -> str:
    """End a search and its trials; what they came to stays."""
    folder, job = _search_of(console, request)
    if job is not None:
        request_stop(console.home, console.home.store(), job.name)
    console.watcher.refresh()
    return _address(folder)


def go_on(console: Console, request: Request, fields: Fields) -> str:
    """Go on with a search that was ended before it was done."""
    folder, job = _search_of(console, request)
    if job is None:
        raise SettingError("{name}: was begun in a terminal; go on with it there.", name=folder.name)
    resume(console.home, console.home.store(), job.name)
    console.watcher.refresh()
    return _address(folder)


def keep(console: Console, request: Request, fields: Fields) -> str:
    """Copy a trial's run among the models."""
    folder, _ = _search_of(console, request)
    record, _ = _read(folder)
    number = one(fields, "trial")
    source = folder / TRIALS / number
    if record is None or number not in {str(trial.number) for trial in record.trials} or not source.is_dir():
        raise SettingError("{number}: is no trial that can be kept; expected one of the table.", number=number[:20])
    workspace = console.workspace
    name = workspace.free(f"tuning-{folder.name}-trial-{number}")
    waiting = folder / f"kept-{number}"
    shutil.rmtree(waiting, ignore_errors=True)
    shutil.copytree(source, waiting)
    make_folder(workspace.path / "runs")
    waiting.rename(workspace.path / "runs" / name)
    console.watcher.refresh()
    return address(name)


def _form(console: Console, form: SearchForm, wrong: str, status: int = 200) -> Page:
    rows, job = _offers(console, form.model)
    data = {
        "form": form.as_dictionary(),
        "offers": [{**offer.as_dictionary(), "range": form.ranges.get(offer.name, offer.range)} for offer in rows],
        "wrong": wrong,
        "trains": shlex.join(["racecraft", *job.spec.command]),
    }
    return Page("tuning_new.html", f"Tune {form.model}", data, here="/jobs", status=status)


def _offers(console: Console, model: str) -> tuple[list[Offer], Job]:
    """Return what may be varied in a model's training, and the job that trained it.

    Raises:
        UserInputError: There is no such model, or no job trained it.
    """
    row = console.index.row(console.workspace.model(model).name)
    if not row["job"]:
        raise SettingError(
            "{name}: was not trained by a job; expected a model that the console or `--detach` trained.", name=model
        )
    return offers(row["kind"], row["algorithm"]), get(console.home.store(), row["job"])


def _folders(console: Console) -> list[Path]:
    return [path for path in (console.workspace.path / TUNINGS).glob("*") if path.is_dir()]


def _jobs(console: Console) -> dict[str, Job]:
    """Return the job of each search, by its folder."""
    jobs = [job for job in console.home.store().jobs() if job.spec.command[0] == "tune"]
    return {str(job.spec.recorded["tuning"]): job for job in jobs if "tuning" in job.spec.recorded}


def _search_of(console: Console, request: Request) -> tuple[Path, Job | None]:
    name = request.path_params["name"]
    folder = next((path for path in _folders(console) if path.name == name), None)
    if folder is None:
        raise WebError(404, "no_such_tuning", f"There is no search {name[:64]!r}; the list shows those that are.")
    return folder, _jobs(console).get(str(folder))


def _read(folder: Path) -> tuple[TuningRecord | None, str]:
    try:
        return read_tuning(folder), ""
    except InputFileError as error:
        return None, str(error)


def _row(folder: Path, job: Job | None) -> dict[str, Any]:
    record, _ = _read(folder)
    best = record.best if record else None
    return {
        "name": folder.name,
        "model": "" if job is None else str(job.spec.recorded.get("model", "")),
        "state": "" if job is None else job.state.value,
        "reason": "" if job is None else job.reason,
        "open": job is not None and not job.ended,
        "begun_here": job is not None,
        "trials": len(record.trials) if record else 0,
        "objective": record.objective.replace("_", " ") if record else "",
        "best": None if best is None else {"number": best.number, "score": plain(best.score), "with": _told(best)},
    }


def _told(trial: TrialRecord) -> str:
    return ", ".join(f"{name} {plain(value)}" for name, value in trial.values.items())


def _charts(record: TuningRecord, job: Job | None) -> Iterator[Chart]:
    """Yield the best so far, and the score over each thing that was varied."""
    done, aim = record.done, record.objective.replace("_", " ")
    if not done:
        return
    numbers, scores, best = record.best_so_far
    tried = [
        Series("a trial", numbers, scores, "dots", colour=2),
        Series("best so far", numbers, best, "steps", colour=1),
    ]
    yield Chart("Trial after trial", "trial", aim, tried)
    for name in list(done[0].values)[:MAX_CHARTS]:
        yield _slice(name, aim, done, scores, job)


def _slice(name: str, aim: str, done: list[TrialRecord], scores: list[float], job: Job | None) -> Chart:
    values = [trial.values.get(name) for trial in done]
    numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
    words = [] if numbers else sorted({str(value) for value in values})
    places = [float(value) if numbers else words.index(str(value)) for value in values]  # type: ignore[arg-type]
    is_log = job is not None and any(
        word.startswith(f"--param={name}=") and word.endswith(":log") for word in job.spec.command
    )
    return Chart(
        f"By {name}", name, aim, [Series("a trial", places, scores, "dots")], log_x=is_log and numbers, names=words
    )  # fmt: skip


def _table(record: TuningRecord | None, folder: Path) -> Mapping[str, Any]:
    """Return every trial, the best first."""
    trials = list(record.trials) if record else []
    sign = -1.0 if record is None or record.maximise else 1.0
    trials.sort(key=lambda trial: (trial.score is None, sign * (trial.score or 0.0)))
    names = list(trials[0].values) if trials else []
    rows = [
        {
            "number": trial.number,
            "score": plain(trial.score),
            "state": trial.state,
            "seconds": plain(trial.seconds),
            "values": [plain(trial.values.get(name)) for name in names],
            "note": f"from {trial.taken_from}" if trial.taken_from else trial.note,
            "kept": trial.is_done and (folder / TRIALS / str(trial.number)).is_dir(),
        }
        for trial in trials
    ]
    return {"names": names, "rows": rows}


def _command(job: Job | None, record: TuningRecord | None, folder: Path) -> str:
    words = job.spec.command if job else ("tune", f"--run={folder}", *(record.command if record else ()))
    place = shlex.quote(job.spec.folder if job else str(folder.parent.parent))
    return f"cd {place}\nracecraft {shlex.join(words)}"


def _address(folder: Path) -> str:
    return f"/tuning/{quote(folder.name)}"


SECTION = Section(routes=routes)
