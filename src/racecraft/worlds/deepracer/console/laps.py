"""The laps of a car's run: where one loses time, beside a reference, and one of them as a file. See `laps_page`."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, get_args
from urllib.parse import quote, urlencode

import numpy as np
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from racecraft.console.pages.model import model_of
from racecraft.console.section import Section
from racecraft.console.service import Console
from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array
from racecraft.formats.run_folder import RunFolder
from racecraft.settings.request import Option, own_options
from racecraft.settings.table import parse_value
from racecraft.web.errors import WebError
from racecraft.worlds.deepracer.analysis.ghosts import line_of
from racecraft.worlds.deepracer.analysis.run_facts import track_of
from racecraft.worlds.deepracer.analysis.telemetry_page import telemetry_data
from racecraft.worlds.deepracer.driving.line_file import line_csv
from racecraft.worlds.deepracer.driving.telemetry.export import lap_names
from racecraft.worlds.deepracer.driving.telemetry.filters import LapOptions
from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps
from racecraft.worlds.deepracer.driving.telemetry.losses import compare_lap
from racecraft.worlds.deepracer.driving.telemetry.reference import Reference, of_best_zones, of_lap
from racecraft.worlds.deepracer.driving.telemetry.timing import LapTiming, time_laps
from racecraft.worlds.deepracer.logs import Logs, read

CHOICES = 12
"""Laps that can be chosen, the fastest first."""
ZONES = "zones"
"""What a lap is compared with where nothing is named: the best corners of all laps together."""


def routes(console: Console) -> list[BaseRoute]:
    """Return the route of a lap as a file."""

    def lap_file(request: Request) -> Response:
        model, row = model_of(console, request)
        which = _conditions(request.query_params)
        timing, order = _laps_of(Path(row["run"]), which) if row["run"] else (None, ())
        if timing is None:
            raise WebError(404, "no_lap", f"{model.name} has no full lap yet.")
        number = _number(request.query_params.get("lap", "1"), len(order))
        line = line_of(of_lap(timing.laps, int(order[number - 1]), ""), timing.laps.track)
        name = quote(f"{model.name}-lap-{number}.csv")
        headers = {"Content-Disposition": f"attachment; filename*=utf-8''{name}"}
        return Response(line_csv(line), media_type="text/csv", headers=headers)

    return [Route("/models/{name}/laps/lap.csv", lap_file)]


def laps_page(run: Path, query: Mapping[str, str]) -> dict[str, Any]:
    """Return what the page of a run's laps shows; `told` is None where there is no full lap.

    Args:
        run: The run folder.
        query: `lap`, counted from 1, the fastest first; `against`: ZONES, or the number of another lap; any option of
            `LapOptions`.

    Raises:
        SettingError: There is no such lap, or none that meets the conditions.
        UserInputError: The run's track or log cannot be read.
    """
    which = _conditions(query)
    timing, order = _laps_of(run, which)
    if timing is None:
        return {"told": None}
    lap, against = _number(query.get("lap", "1"), len(order)), query.get("against", ZONES)
    compared = compare_lap(timing, int(order[lap - 1]), _reference(timing, order, against))
    names = lap_names(timing)
    given = which.named()
    words = [word for row, value in given.items() for word in row.words(value)]
    choices = [
        (str(number), f"{number}: {timing.laps.lap_seconds[row]:.2f} s, {names[row]}")
        for number, row in enumerate(order[:CHOICES], 1)
    ]
    return {
        "told": telemetry_data(compared),
        "lap": str(lap),
        "against": against,
        "lap_choices": choices,
        "conditions": [_field(row, getattr(which, row.name)) for row in own_options(LapOptions)],
        "file": "lap.csv?" + urlencode({row.name: value for row, value in given.items()} | {"lap": lap}),
        "command": shlex.join(["racecraft", "telemetry", str(run), f"--lap={lap}", *words, "--line=lap.csv"]),
        "against_choices": [(ZONES, "the best corners of all laps"), *choices],
    }


def _laps_of(run: Path, which: LapOptions) -> tuple[LapTiming | None, Array]:
    """Return the laps of a run that count, and their rows, the fastest first; (None, none) where no lap is full.

    Raises:
        SettingError: No full lap meets the conditions.
    """
    timed = _timing(str(run), _changed_at(run / "episodes"))
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
def _timing(run: str, changed: float) -> tuple[LapTiming, Logs] | None:
    """Return a run's full laps with their times, and its log; None where there is none."""
    track = track_of(RunFolder(Path(run)).read_job())
    if track is None or not any((Path(run) / "episodes").glob("*.parquet")):
        return None
    log = read([Path(run)])
    laps = find_laps(log.require_ticks(), track)
    return (time_laps(laps), log) if len(laps) else None


def _number(text: str, count: int) -> int:
    if not text.isdigit() or not 1 <= int(text) <= count:
        raise SettingError("lap is {text!r}; expected 1 to {count}, the fastest first.", text=text[:20], count=count)
    return int(text)


def _reference(timing: LapTiming, order: Array, against: str) -> Reference:
    if against == ZONES:
        return of_best_zones(timing)
    return of_lap(timing.laps, int(order[_number(against, len(order)) - 1]), f"lap {against}")


SECTION = Section(routes=routes)
