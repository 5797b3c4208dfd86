"""A league as files for others: boards as CSV and JSON, and a site of plain pages. Begin with `write_site`."""

from __future__ import annotations

import csv
import io
import json
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.league.board import Board
from racecraft.league.board_table import table_of
from racecraft.league.race import Race
from racecraft.league.records import fastest_laps
from racecraft.league.scoring import ranking_text
from racecraft.league.seasons import standings
from racecraft.league.snapshot import snapshot_of
from racecraft.league.store import League
from racecraft.league.world_part import league_world
from racecraft.pages.render import render_file

CSV_COLUMNS = (
    "place", "racer", "model", "score", "gap", "interval", "best_lap_seconds", "laps_seconds", "resets",
    "penalty_seconds", "submissions", "entry", "heat", "judged", "games", "wins", "faults",
)  # fmt: skip
TEMPLATE = "racecraft.league/site.html"


def board_csv(board: Board) -> str:
    """Return a board as comma-separated values; seconds, and moments in ISO 8601 (UTC)."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(CSV_COLUMNS)
    for row in board.rows:
        judged = "" if row.judged is None else time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(row.judged))
        laps = " ".join("-" if lap is None else f"{lap:.6f}" for lap in row.laps)
        values = (
            row.place, _safe(row.racer), _safe(row.model), row.score, row.gap, row.interval, row.best_lap_seconds, laps,
            row.resets, row.penalty_seconds, row.submissions, row.entry, row.heat, judged, row.games, row.wins,
            row.faults,
        )  # fmt: skip
        table.writerow(["" if value is None else value for value in values])
    return text.getvalue()


def _safe(name: str) -> str:
    """Return a name that a spreadsheet does not take for a formula."""
    return f"'{name}" if name[:1] in "=+-@" else name


def board_json(board: Board) -> str:
    """Return a board as JSON, with its race."""
    race = {name: value for name, value in asdict(board.race).items() if name != "person"}
    return json.dumps(
        {"format": "racecraft board", "version": 1, "race": race, "rows": [asdict(row) for row in board.rows]},
        ensure_ascii=False,
        indent=2,
    )


def write_site(league: League, folder: Path, now: float) -> list[Path]:
    """Write every board, season and fastest lap as pages that need no server; return the files.

    Args:
        league: The league.
        folder: Where to; files of an earlier site are replaced.
        now: Seconds since 1970.

    Raises:
        OutputFileError: The folder cannot be written.
    """
    make_folder(folder)
    boards = [snapshot_of(league, race).board for race in league.races()]
    files = [_write_page(folder / "index.html", "Races", "", index_sections(league, boards, now))]
    for board in boards:
        race = board.race
        about = f"{', '.join(race.tracks)} · {ranking_text(race)}"
        files.append(_write_page(folder / f"{race.id}.html", race.title, about, [_board_section(board)], race))
        for name, text in ((f"{race.id}.csv", board_csv(board)), (f"{race.id}.json", board_json(board))):
            write_atomic(folder / name, text)
            files.append(folder / name)
    return files


def index_sections(league: League, boards: list[Board], now: float) -> list[dict[str, Any]]:
    """Return the tables of the first page: races, seasons, fastest laps."""
    races = [
        [
            {"text": board.race.title, "href": f"{board.race.id}.html"},
            ", ".join(board.race.tracks),
            "open" if board.race.is_open(now) else "closed",
            str(len(board.rows)),
            next((row.racer for row in board.rows if row.place == 1), "–"),
        ]
        for board in boards
    ]
    sections = [{"title": "Races", "heads": ["Race", "Track", "Entries", "Racers", "Leader"], "rows": races}]
    for season in league.seasons():
        found = standings(league, season, now)
        rows = [[str(row.place), row.racer, *map(str, row.race_points), str(row.points)] for row in found.rows]
        champion = f" · champion: {', '.join(found.leaders)}" if found.is_over and found.rows else ""
        heads = ["Place", "Racer", *(race.title for race in found.races), "Points"]
        sections.append({"title": season.title + champion, "heads": heads, "rows": rows})
    records = [
        [one.track, one.type.replace("_", " ").lower(), f"{one.seconds:.3f} s", one.racer, one.model]
        for one in fastest_laps(league)
    ]
    sections.append({"title": "Fastest laps", "heads": ["Track", "Race", "Lap", "Racer", "Model"], "rows": records})
    return sections


def _board_section(board: Board) -> dict[str, Any]:
    heads, rows = table_of(board)
    return {"title": "Board", "heads": [head.capitalize() for head in heads], "rows": [list(row) for row in rows]}


def _write_page(path: Path, title: str, about: str, sections: list[dict[str, Any]], race: Race | None = None) -> Path:
    rules = [] if race is None else league_world(race.kind).describe(race.rules, race.tracks)
    downloads = [] if race is None else [f"{race.id}.csv", f"{race.id}.json"]
    page = render_file(TEMPLATE, title=title, about=about, sections=sections, rules=rules, downloads=downloads,
                       is_index=race is None)  # fmt: skip
    write_atomic(path, page)
    return path
