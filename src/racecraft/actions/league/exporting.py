"""Boards as files for others."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.actions.league.options import LeagueOptions
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import argument, option

FORMATS = ("csv", "json", "site")


@dataclass(frozen=True, kw_only=True)
class ExportLeagueRequest(LeagueOptions):
    """What is written, and where to."""

    race: str | None = argument("A race, for csv and json.", None)
    to: str = option("site", "csv or json: one race's board; site: pages of the whole league.", choices=FORMATS)
    out: Path | None = option(None, "A file, or the site's folder; by default RACE.csv, RACE.json, or site.")


@dataclass(frozen=True)
class ExportedLeague:
    """What was written."""

    files: tuple[Path, ...]


@action
def export_league(request: ExportLeagueRequest, progress: Progress = quiet) -> ExportedLeague:
    """Write a board as CSV or JSON, or the whole league as a site of plain pages.

    Examples:

        racecraft league export club-evening --to csv

        racecraft league export --to site --out public
    """
    from racecraft.formats.atomic import write_atomic
    from racecraft.league.site import board_csv, board_json, write_site
    from racecraft.league.snapshot import snapshot_of

    league = request.open()
    if request.to == "site":
        if request.race is not None:
            raise SettingError("a site shows every race; expected no RACE with --to site.")
        return ExportedLeague(tuple(write_site(league, request.out or Path("site"), time.time())))
    if request.race is None:
        raise SettingError("--to {to} writes one board; expected a RACE.", to=request.to)
    board = snapshot_of(league, league.race(request.race)).board
    path = request.out or Path(f"{board.race.id}.{request.to}")
    write_atomic(path, board_csv(board) if request.to == "csv" else board_json(board))
    return ExportedLeague((path,))
