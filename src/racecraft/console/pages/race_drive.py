"""A judged drive: beside the leader's, its trace and log to take along, its film on demand."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from urllib.parse import quote

from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Route

from racecraft.accounts.rights import Verb, may
from racecraft.console.pages.race_parts import league_of, organises, race_of, shown_folder
from racecraft.console.parts import parts_of
from racecraft.console.section import Section
from racecraft.console.service import Console, Fields, Page, act_route, one, page_routes, person_of
from racecraft.league.race import SOLO, Entry, Race, Result
from racecraft.league.snapshot import snapshot_of
from racecraft.league.store import League
from racecraft.web.errors import WebError

FILMING = "Filming"
OTHERS = 100
"""Of the board, the first, beside whom a drive can be seen."""


@dataclass(frozen=True)
class Driven:
    """A judged heat on one of its race's tracks."""

    league: League
    race: Race
    result: Result
    entries: Mapping[int, Entry]
    """Of the race, by number."""
    number: int
    """Of the track, from 0."""
    seat: int
    """Which of those who drove, from 0."""

    @property
    def folder(self) -> Path:
        """Where its files are."""
        return folder_of(self.league, self.race, self.result.heat, self.number)

    @property
    def film(self) -> Path:
        """Its film, where there is one; of those who met each has one."""
        return self.folder / ("film.mp4" if self.seat == 0 else f"film-{self.seat + 1}.mp4")

    def racer(self, seat: int) -> str:
        """Return the name of one who drove."""
        entry = self.entries.get(self.result.entries[seat])
        return entry.racer if entry else "withdrawn"

    @property
    def path(self) -> str:
        """Address of its page."""
        return f"/races/{self.race.id}/drives/{quote(self.result.heat)}"


def routes(console: Console) -> list[BaseRoute]:
    """Return the routes of a drive."""

    def files(request: Request) -> Response:
        return files_answer(_driven(console, request, request.query_params), request)

    def film(request: Request) -> Response:
        return FileResponse(_film_of(console, request), media_type="video/mp4")

    def poster(request: Request) -> Response:
        from racecraft.analysis.page import first_picture

        with _film_of(console, request).open("rb") as file:
            return Response(first_picture(file), media_type="image/jpeg")

    path = "/races/{id}/drives/{heat}"
    return [
        *page_routes(console, path, drive_page),
        Route(f"{path}/files.zip", files),
        Route(f"{path}/film.mp4", film),
        Route(f"{path}/film.jpg", poster),
        act_route(console, f"{path}/film", begin_film),
    ]


def _film_of(console: Console, request: Request) -> Path:
    driven = _driven(console, request, request.query_params)
    if not driven.film.is_file():
        raise WebError(404, "no_film", "this drive was not filmed yet; its page has a button for that.")
    return driven.film


def drive_page(console: Console, request: Request) -> Page:
    """Return a drive beside the leader's, or beside any other of the race; of those who met, beside each other."""
    driven = _driven(console, request, request.query_params)
    race, result, seat = driven.race, driven.result, driven.seat
    racer, track = driven.racer(seat), race.tracks[driven.number]
    drives = [(racer, driven.folder, seat), *_others(driven)]
    template, data = parts_of(race.kind).drive_page(race, track, drives, dict(request.query_params))
    about = {
        "race": asdict(race), "racer": racer, "heat": result.heat,
        "outcome": asdict(result.drives[driven.number].outcomes[seat]), "track_number": driven.number,
        "entry": result.entries[seat], "query": f"track={driven.number}&entry={result.entries[seat]}",
        "path": driven.path, "back": f"/races/{race.id}", "commands": _commands(driven, request),
        "takes_files": _takes_files(driven, request), "is_filmed": driven.film.is_file(),
        "films": may(person_of(request), Verb.ENTER), "task": console.tasks.of(_key(driven), FILMING),
    }  # fmt: skip
    return Page(template, f"{racer} in {race.title}", {**about, **data}, here="/races")


def _others(driven: Driven) -> list[tuple[str, Path, int]]:
    """Return the drives beside which one can be seen, as `WorldParts.drive_page` takes them."""
    league, race, heat = driven.league, driven.race, driven.result.heat
    if race.format != SOLO:
        seats = (seat for seat in range(len(driven.result.entries)) if seat != driven.seat)
        return [(driven.racer(seat), driven.folder, seat) for seat in seats]
    return [
        (row.racer, folder_of(league, race, row.heat, driven.number), 0)
        for row in snapshot_of(league, race).board.rows[:OTHERS]
        if row.heat and row.heat != heat
    ]


def files_answer(driven: Driven, request: Request) -> Response:
    """Return trace, log, metrics and replay of one's own drive as a zip; organisers get everybody's.

    Raises:
        WebError: The drive is another person's.
    """
    if not _takes_files(driven, request):
        raise WebError(403, "not_allowed", "this drive is another person's; only they and organisers take its files.")
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in sorted(driven.folder.rglob("*")):
            if file.is_file() and not file.name.startswith("film"):
                archive.write(file, file.relative_to(driven.folder).as_posix())
    name = f"{driven.race.id}-{driven.result.heat}.zip"
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    return Response(packed.getvalue(), media_type="application/zip", headers=headers)


def begin_film(console: Console, request: Request, fields: Fields) -> str:
    """Have a drive filmed; its page shows the film when it is there."""
    driven = _driven(console, request, {name: one(fields, name) for name in ("track", "entry")})
    entry = driven.result.entries[driven.seat]
    if not driven.film.is_file():
        words = {
            "heat": driven.result.heat, "track": driven.number + 1, "league": driven.league.path.resolve(),
            "out": driven.film.resolve(),
        }  # fmt: skip
        typed = ["league", "film", driven.race.id, str(entry)]
        typed += [f"--{name}={value}" for name, value in words.items()]
        console.tasks.begin(_key(driven), FILMING, typed, console.workspace.path)
    return f"{driven.path}?track={driven.number}&entry={entry}"


def folder_of(league: League, race: Race, heat: str, track: int) -> Path:
    """Return where the files of a heat on one track are."""
    return league.folder(race.id) / "drives" / f"{heat}-{track}"


def _driven(console: Console, request: Request, query: Mapping[str, str]) -> Driven:
    """Return the drive that an address names; the first one unless `track` and `entry` say which.

    Raises:
        WebError: There is none.
    """
    league = league_of(console)
    race = race_of(league, request.path_params["id"])
    result = league.results(race.id).get(request.path_params["heat"])
    if result is None or not result.drives:
        raise WebError(404, "no_such_drive", "this race has no such drive; begin at its board.")
    track, entry = (int(text) if text.isascii() and text.isdigit() else 0
                    for text in (query.get("track", ""), query.get("entry", "")))  # fmt: skip
    seat = result.entries.index(entry) if entry in result.entries else 0
    return Driven(league, race, result, league.entries(race.id), min(track, len(result.drives) - 1), seat)


def _takes_files(driven: Driven, request: Request) -> bool:
    person = person_of(request)
    own = {entry.person for number in driven.result.entries if (entry := driven.entries.get(number))}
    return organises(request) or person.owned in own


def _key(driven: Driven) -> str:
    return f"race {driven.race.id} {driven.result.heat} {driven.number} {driven.seat}"


def _commands(driven: Driven, request: Request) -> str:
    folder = shown_folder(request, driven.folder)
    return "\n".join((
        *([f"racecraft logs {folder}", f"racecraft telemetry {folder}"] if driven.race.format == SOLO else []),
        f"racecraft league film {driven.race.id} {driven.result.entries[driven.seat]} --heat {driven.result.heat}",
    ))  # fmt: skip


SECTION = Section(routes=routes)
