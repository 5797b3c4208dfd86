"""Two to five models, or groups of seeds, side by side: a verdict with how sure it is, curves, and what differs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import urlencode

import sqlalchemy as sql
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from racecraft.console.index_tables import MODELS
from racecraft.console.parts import Look, WorldParts, parts_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, looked, page_routes
from racecraft.console.verdicts import JUDGING, begin_judging, kept_verdict
from racecraft.contract.errors import RacecraftError, SettingError
from racecraft.evaluation.run_groups import SeedGroup, differences, group_runs

MOST = 12
"""Models on one page: seeds of a few groups."""
OFFERED = 100
"""Trained models, the newest, that the page offers to choose from."""
COMMAND = "compare"


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of the comparison."""

    def look(request: Request) -> Response:
        rows = _trained(console, request.query_params.getlist("m"))
        groups = group_runs([row["run"] for row in rows])
        return looked(console, request, parts_of(rows[0]["kind"]).compared_look(groups))

    return [
        *page_routes(console, "/compare", compare_page),
        Route("/compare/look", look),
        act_route(console, "/compare", judge_fresh_starts),
    ]


def compare_page(console: Console, request: Request) -> Page:
    """Return what the models that the address names have in common, and what not."""
    names = list(dict.fromkeys(request.query_params.getlist("m")))
    rows = [console.index.row(name) for name in names[:MOST]]
    wrong = ""
    if len(names) < 2:
        wrong = "Select two models or more in the garage, then Compare."
    elif not all(row["run"] for row in rows):
        wrong = "A model that was never trained has nothing to compare."
    groups: list[dict[str, Any]] = []
    differing: list[dict[str, Any]] = []
    charts: list[dict[str, Any]] = []
    look: Look | None = None
    if not wrong:
        try:
            found = group_runs([row["run"] for row in rows])
            groups = [{"name": group.name, "runs": [one.name for one in group.runs]} for group in found]
            differing = [
                {"name": one.name, "values": [_shown(value) for value in one.values]} for one in differences(found)
            ]
            kind = parts_of(rows[0]["kind"])
            charts, look = _charts(found, kind), kind.compared_look(found)
        except RacecraftError as error:
            wrong = str(error)
    verdict = kept_verdict(console, COMMAND, rows)
    return Page(
        "compare.html",
        "Compare",
        {
            "rows": rows,
            "names": names,
            "offered": _offered(console),
            "wrong": wrong,
            "groups": groups,
            "differing": differing,
            "charts": charts,
            "look": "/compare/look?" + _query(rows) if look else "",
            "stage_modules": list(look.modules) if look else [],
            "stage_styles": list(look.styles) if look else [],
            "verdict": verdict,
            "dots": _dots(verdict) if verdict else None,
            "task": console.tasks.of(_key(rows), JUDGING),
            "command": "racecraft " + " ".join(_words(rows)) if rows else "",
        },
    )


def judge_fresh_starts(console: Console, request: Request, fields: Fields) -> str:
    """Begin to judge every model's best checkpoint on fresh starts."""
    rows = _trained(console, fields.get("m", []))
    begin_judging(console, _key(rows), _words(rows), rows)
    return "/compare?" + _query(rows)


def _trained(console: Console, names: Sequence[str]) -> list[dict[str, Any]]:
    """Return the rows of models that can be compared.

    Raises:
        SettingError: They are fewer than two, or one was never trained.
    """
    rows = [console.index.row(name) for name in list(dict.fromkeys(names))[:MOST]]
    if len(rows) < 2 or not all(row["run"] for row in rows):
        raise SettingError("compare: expected two models or more that were trained.")
    return rows


def _query(rows: Sequence[Mapping[str, Any]]) -> str:
    return urlencode([("m", row["name"]) for row in rows])


def _offered(console: Console) -> list[str]:
    """Return the names of trained models, the newest first."""
    trained = sql.select(MODELS.c.name).where(MODELS.c.run != "").order_by(MODELS.c.changed.desc()).limit(OFFERED)
    return [row["name"] for row in console.index.query(trained)]


def _words(rows: list[dict[str, Any]]) -> list[str]:
    return [COMMAND, *(row["run"] for row in rows)]


def _key(rows: list[dict[str, Any]]) -> str:
    """Return what names a comparison among the tasks."""
    return " ".join(sorted(row["name"] for row in rows))


def _charts(groups: list[SeedGroup], kind: WorldParts) -> list[dict[str, Any]]:
    """Return how the score of each model and its world's own figure went."""
    from racecraft.analysis.compare_page import curves_chart

    return [curves_chart(groups, title, unit, column).shown() for title, unit, column in kind.compared()]


def _dots(verdict: dict[str, Any]) -> dict[str, Any]:
    from racecraft.analysis.compare_page import dots

    groups = [(group["name"], [seed["values"] for seed in group["seeds"]]) for group in verdict["groups"]]
    return dots(groups, verdict["measure"])


def _shown(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(value)
    return "–" if value is None else text if len(text) <= 60 else f"{text[:57]}…"


SECTION = Section(routes=routes)
