"""The laps of a car's run: where one loses time, beside a reference, and one of them as a file. See `laps_page`."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, get_args
from urllib.parse import quote, urlencode

import numpy as np
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from racecraft.console.pages.create import clone_draft
from racecraft.console.pages.model import model_of
from racecraft.console.pages.race_parts import drives_of
from racecraft.console.paging import list_address, page_of
from racecraft.console.parts import RaceDrive
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, act_route
from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array
from racecraft.formats.run_folder import RunFolder
from racecraft.settings.request import Option, own_options
from racecraft.settings.table import parse_value
from racecraft.web.errors import WebError
from racecraft.worlds.deepracer.analysis.ghosts import line_of
from racecraft.worlds.deepracer.analysis.logs.circuit import is_of
from racecraft.worlds.deepracer.analysis.run_facts import track_of
from racecraft.worlds.deepracer.analysis.telemetry_page import lap_table, telemetry_data
from racecraft.worlds.deepracer.console.car_form import TEMPLATES
from racecraft.worlds.deepracer.console.car_values import values_of
from racecraft.worlds.deepracer.console.race_drive import car_folder
from racecraft.worlds.deepracer.driving.line_file import line_csv
from racecraft.worlds.deepracer.driving.telemetry.export import lap_names
from racecraft.worlds.deepracer.driving.telemetry.filters import LapOptions
from racecraft.worlds.deepracer.driving.telemetry.laps import Laps, find_laps
from racecraft.worlds.deepracer.driving.telemetry.losses import LapComparison, compare_lap
from racecraft.worlds.deepracer.driving.telemetry.reference import Reference, of_best_zones, of_lap
from racecraft.worlds.deepracer.driving.telemetry.timing import LapTiming, time_laps
from racecraft.worlds.deepracer.logs import Logs, read
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.logs.sources import find_sources

CHOICES = 12
"""Laps that can be chosen, the fastest first."""
SOURCES = (("training", "training"), ("evaluation", "evaluations"), ("leaderboard", "races"))
"""Where laps stem from, as `LapOptions.phase` names it and in words."""
ZONES = "zones"
"""What a lap is compared with where nothing is named: the best corners of all laps together."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the route of a lap as a file."""

    def lap_file(request: Request) -> Response:
        model, row = model_of(console, request)
        which, drives = _conditions(request.query_params), drives_of(console, request, row)
        timing, order = _laps_of(Path(row["run"]), drives, which) if row["run"] else (None, ())
        if timing is None:
            raise WebError(404, "no_lap", f"{model.name} has no full lap yet.")
        number = _number(request.query_params.get("lap", "1"), len(order))
        line = line_of(of_lap(timing.laps, int(order[number - 1]), ""), timing.laps.track)
        name = quote(f"{model.name}-lap-{number}.csv")
        headers = {"Content-Disposition": f"attachment; filename*=utf-8''{name}"}
        return Response(line_csv(line), media_type="text/csv", headers=headers)

    return [
        Route("/models/{name}/laps/lap.csv", lap_file),
        act_route(console, "/models/{name}/laps/design", design_clone),
    ]


def design_clone(console: Console, request: Request, fields: Fields) -> str:
    """Begin a clone with the actions that lose least time on the model's track; it begins with fresh weights."""
    model, row = model_of(console, request)
    values = values_of(RunFolder(Path(row["run"])))
    place = (str(values["track"]), bool(values["reverse"]))
    actions = console.helper.ask(f"{TEMPLATES}.car_look:design_actions", str(values["actions"]), *place)
    draft = clone_draft(console, model.name, typed={"actions": actions, "weights": False})
    return f"/drafts/{draft.id}/car"


def laps_page(run: Path, query: Mapping[str, str], drives: Sequence[RaceDrive] = ()) -> dict[str, Any]:
    """Return what the page of a run's laps shows; `told` is None where there is no full lap.

    Laps of its training, of evaluations and of races stand beside each other; `phase` chooses among them.

    Args:
        run: The run folder.
        query: `lap`, counted from 1, the fastest first; `against`: ZONES, or the number of another lap; any option of
            `LapOptions`.
        drives: What the model drove in races.

    Raises:
        SettingError: There is no such lap, or none that meets the conditions.
        UserInputError: The run's track or log cannot be read.
    """
    which = _conditions(query)
    timing, order = _laps_of(run, drives, which)
    if timing is None:
        return {"told": None}
    lap, against = _number(query.get("lap", "1"), len(order)), query.get("against", ZONES)
    compared = compare_lap(timing, int(order[lap - 1]), _reference(timing, order, against))
    names = lap_names(timing)
    given = which.named()
    words = [word for row, value in given.items() for word in row.args(value)]
    numbers = [*range(1, min(CHOICES, len(order)) + 1), *([lap] if lap > CHOICES else [])]
    choices = [
        (str(number), f"{number}: {timing.laps.lap_seconds[row]:.2f} s, {names[row]}")
        for number, row in ((number, order[number - 1]) for number in numbers)
    ]
    told, job = telemetry_data(compared), RunFolder(run).read_job()
    told["laps"], pages = _lap_list(compared, order, names, query)
    return {
        "told": told,
        "pages": pages,
        "lap": str(lap),
        "against": against,
        "lap_choices": choices,
        "sources": [("", "all"), *SOURCES],
        "phase": which.phase or "",
        "conditions": [_field(row, getattr(which, row.name)) for row in own_options(LapOptions) if row.name != "phase"],
        "file": "lap.csv?" + urlencode({row.name: value for row, value in given.items()} | {"lap": lap}),
        "command": shlex.join(
            [
                "racecraft",
                "telemetry",
                str(run),
                *(folder for folder, _ in _races_here(run, drives)),
                f"--lap={lap}",
                *words,
                "--line=lap.csv",
            ]
        ),
        "has_table": isinstance((job.get("model_metadata") or {}).get("action_space"), list),
        "against_choices": [(ZONES, "the best corners of all laps"), *choices],
    }


def _lap_list(
    compared: LapComparison, order: Array, names: Sequence[str], query: Mapping[str, str]
) -> tuple[dict[str, Any], dict[str, str]]:
    """Return a page of the table of laps, each with its address, and the addresses of the pages around it."""
    laps = compared.timing.laps
    begins = laps.ticks["time_s"][laps.about["first_row"].to_list()]
    numbers = {int(row): number for number, row in enumerate(order, 1)}
    page = page_of(
        "laps", query, list(numbers), lambda row: (float(laps.lap_seconds[row]), f"{names[row]} {begins[row]:.3f}")
    )
    table = lap_table(compared, names, page.rows)
    for row, shown in zip(page.rows, table["rows"], strict=True):
        shown["href"] = list_address("laps", query, lap=str(numbers[row]))
    return table, page.links


def _laps_of(run: Path, drives: Sequence[RaceDrive], which: LapOptions) -> tuple[LapTiming | None, Array]:
    """Return the laps of a run that count, and their rows, the fastest first; (None, none) where no lap is full.

    Raises:
        SettingError: No full lap meets the conditions.
    """
    timed = timed_laps(run, drives)
    if timed is None:
        return None, np.empty(0, int)
    timing, log = timed
    rows = which.rows(timing.laps, log)
    if not len(rows):
        raise SettingError(
            "none of the {count} full laps meets all conditions; expected one at least. Take one back.",
            count=len(timing.laps),
        )
    if len(rows) < len(timing.laps):
        timing = time_laps(timing.laps.take(rows))
    return timing, np.argsort(timing.laps.lap_seconds, kind="stable")


def timed_laps(run: Path, drives: Sequence[RaceDrive] = ()) -> tuple[LapTiming, Logs] | None:
    """Return a run's full laps with their times, and its log; None where there is none. Arguments as of `laps_page`."""
    return _timing(str(run), max(_changed_at(run), _changed_at(run / "episodes")), tuple(_races_here(run, drives)))


def _races_here(run: Path, drives: Sequence[RaceDrive]) -> Iterator[tuple[str, str]]:
    """Yield the folder of each drive on the run's own track, the same way round, and the title of its race."""
    job = RunFolder(run).read_job()
    name, race = (job.get("track") or {}).get("name"), (job.get("settings") or {}).get("race", {})
    for drive in drives:
        if drive.track == name and bool(drive.race.rules.get("reverse")) == bool(race.get("reverse")):
            folder = car_folder(drive.folder, drive.seat)
            if Path(folder).is_dir():
                yield folder, drive.race.title


def _conditions(query: Mapping[str, str]) -> LapOptions:
    """Return which laps count.

    Raises:
        SettingError: A value that no lap can have.
    """
    rows = [row for row in own_options(LapOptions) if query.get(row.name)]
    return LapOptions(**{row.name: parse_value(row, query[row.name]) for row in rows})


def _field(row: Option, value: Any) -> dict[str, Any]:
    """Return a condition as `parts.field` takes it."""
    kinds = [(bool, "check"), (int, "number"), (float, "number")]
    kind = next((word for one, word in kinds if one in (row.kind, *get_args(row.kind))), "text")
    return {
        "name": row.name, "label": row.name.replace("_", " ").capitalize(), "hint": row.doc,
        "value": "" if value is None else value, "kind": "select" if row.choices else kind,
        "options": [("", "any"), *((one, one) for one in row.choices)],
    }  # fmt: skip


def _changed_at(path: Path) -> float:
    """Return when a folder last changed: laps are read again then."""
    try:
        return path.stat().st_mtime
    except OSError:
        return 0.0


@lru_cache(maxsize=8)
def _timing(run: str, changed: float, races: tuple[tuple[str, str], ...]) -> tuple[LapTiming, Logs] | None:
    """Return a run's full laps with their times, and its log; None where there is none.

    Args:
        run: The run folder.
        changed: When it last did.
        races: As `_races_here` yields.
    """
    track = track_of(RunFolder(Path(run)).read_job())
    if track is None:
        return None
    places = [*([run] if _has_log(run) else []), *(folder for folder, _ in races)]
    if not places:
        return None
    log = read(places)
    rounds = max(source.round for source in log.sources) - len(races)
    titles = {rounds + number: title for number, (_, title) in enumerate(races, 1)}
    laps = replace(find_laps(log.require_ticks(), track), titles=titles)
    laps = laps.take(_driven_here(laps))
    return (time_laps(laps), log) if len(laps) else None


def _has_log(run: str) -> bool:
    """Tell whether a run has kept an episode yet."""
    try:
        return bool(find_sources(run))
    except LogError:
        return False


def _driven_here(laps: Laps) -> Array:
    """Return the rows of laps but for those of evaluations on another track, or the other way round."""
    judged = ("round", "phase", "stream")
    elsewhere = [
        key
        for key, ticks in laps.ticks.filter(laps.ticks["phase"] != "training")
        .partition_by(*judged, as_dict=True)
        .items()
        if not is_of(ticks, laps.track)
    ]
    keys = laps.about.select(*judged).rows()
    return np.flatnonzero([key not in elsewhere for key in keys])


def _number(text: str, count: int) -> int:
    if not text.isdigit() or not 1 <= int(text) <= count:
        raise SettingError("lap is {text!r}; expected 1 to {count}, the fastest first.", text=text[:20], count=count)
    return int(text)


def _reference(timing: LapTiming, order: Array, against: str) -> Reference:
    if against == ZONES:
        return of_best_zones(timing)
    return of_lap(timing.laps, int(order[_number(against, len(order)) - 1]), f"lap {against}")


SECTION = Section(routes=routes)
