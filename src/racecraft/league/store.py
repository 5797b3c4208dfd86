"""A league's folder: the only truth about its races. Begin with `League`.

    league.json                        makes the folder a league
    secret                             from which the seeds of drives are made; readable by its owner alone
    seasons/ID.json
    races/ID/race.json
    races/ID/tracks/NAME.npy           tracks that are the organiser's own, as they were when the race was made
    races/ID/entries/NNNNN/            entry.json, and model/ as the world has copied it
    races/ID/results/HEAT.json         of a judged heat; written last, whole or not at all
    races/ID/drives/HEAT-K/            replay, trace, log and metrics of the heat on track K
    races/ID/driving.json              the heat that is driven now, while it is
    races/ID/withdrawn/, past/         entries that were taken back; results before a reset

A result, once written, stays as it is; a reader reads each file once.
"""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import os
import re
import secrets
import shutil
import tempfile
import time
import unicodedata
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from racecraft.contract.errors import InputFileError, SettingError, UserInputError, nearest
from racecraft.contract.message import Message
from racecraft.formats.atomic import OutputFileError, atomic_file, make_folder, output_error, write_atomic
from racecraft.formats.run_lock import FileLock
from racecraft.formats.user_file import read_regular
from racecraft.league.race import Driving, Entry, Race, Result, Season

MARK, SECRET = "league.json", "secret"
RACE, ENTRY, MODEL = "race.json", "entry.json", "model"
RACES, SEASONS, ENTRIES, RESULTS, DRIVES = "races", "seasons", "entries", "results", "drives"
WITHDRAWN, PAST, TRACKS, DRIVING = "withdrawn", "past", "tracks", "driving.json"
VERSION = 1
MAX_ENTRIES = 99_999
SETTLED_NS = 100_000_000
"""A folder that changed within 0.1 s may change again without another time of its change."""

Kept = TypeVar("Kept")
Key = TypeVar("Key")


class LeagueError(InputFileError):
    """A file of a league is missing, damaged, or of a newer version."""


@dataclass(frozen=True)
class _Folder:
    """What a folder held when it was looked at."""

    state: tuple[int, int] | None = None
    values: Mapping[tuple[str, int], Any] = field(default_factory=dict)
    """By name and inode."""
    by_key: Mapping[Any, Any] = field(default_factory=dict)


class League:
    """Races, entries, results and seasons in a folder.

    Args:
        path: The folder.

    Raises:
        LeagueError: It is no league.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not (self.path / MARK).is_file():
            found = Message("holds no {mark}", mark=MARK) if self.path.is_dir() else "there is no such folder"
            raise LeagueError(self.path, found, "the folder of a league", "Make a race: racecraft league create TITLE")
        self._read: dict[Path, tuple[tuple[int, int], Any]] = {}
        self._folders: dict[Path, _Folder] = {}

    @classmethod
    def open_or_create(cls, path: str | Path) -> League:
        """Open a league; make its folder where there is none.

        Raises:
            OutputFileError: The folder cannot be written.
        """
        path = Path(path)
        if not (path / MARK).is_file():
            for name in (RACES, SEASONS):
                make_folder(path / name)
            _write_secret(path / SECRET)
            write_atomic(path / MARK, _as_json({"format": "racecraft league", "version": VERSION}))
        return cls(path)

    def seed(self, race: str, heat: str, track: int) -> int:
        """Return the seed of a drive, 0 to 2^31 - 1: the same whenever it is driven, and unknown before.

        Raises:
            LeagueError: The league's secret is gone.
        """
        return int.from_bytes(self._signed(f"{race}/{heat}/{track}")[:4], "big") >> 1

    def screen_token(self, race: Race) -> str:
        """Return what the link of a race's screens shows, as long as it holds; "": the race has no link.

        Raises:
            LeagueError: The league's secret is gone.
        """
        return self._signed(f"screen/{race.id}/{race.screen}").hex() if race.screen else ""

    def _signed(self, text: str) -> bytes:
        """Return what only this league makes of a text, 32 bytes."""
        try:
            secret = (self.path / SECRET).read_bytes()
        except OSError as error:
            raise LeagueError(
                self.path / SECRET, Message("cannot be read ({error})", error=error.strerror), "the league's secret",
                "Put it back from a copy; without it drives cannot be judged.",
            ) from error  # fmt: skip
        return hmac.digest(secret, text.encode(), hashlib.sha256)

    def races(self) -> list[Race]:
        """Return all races, the newest first."""
        files = (self.path / RACES).glob(f"*/{RACE}")
        return sorted((self._kept(file, Race) for file in files), key=lambda race: (-race.created, race.id))

    def race(self, id: str) -> Race:
        """Return a race by its id, or by its title where only one has it.

        Raises:
            SettingError: There is none, or several have the title.
        """
        if re.fullmatch(r"[a-z0-9-]{1,100}", id) and (file := self.folder(id) / RACE).is_file():
            return self._kept(file, Race)
        races = self.races()
        named = [race for race in races if race.title.casefold() == id.casefold()]
        if len(named) == 1:
            return named[0]
        if named:
            ids = ", ".join(race.id for race in named)
            raise SettingError("{count} races are called {id!r}; expected an id: {ids}.", count=len(named), id=id,
                               ids=ids)  # fmt: skip
        known = [race.id for race in races]
        raise SettingError("{league} has no race {id!r}. {hint}", league=self.path, id=id, hint=nearest(id, known))

    def add_race(self, race: Race, tracks: Mapping[str, bytes] | None = None) -> Race:
        """Keep a new race; return it with the id that it got, made from its title.

        Args:
            race: The race.
            tracks: Files of its tracks that not everybody has, by name: "mine.npy".

        Raises:
            OutputFileError: The folder cannot be written.
        """
        taken = _take_name(self.path / RACES, slug(race.title))
        race = replace(race, id=taken)
        for name in (ENTRIES, RESULTS, DRIVES):
            make_folder(self.folder(taken) / name)
        for name, data in (tracks or {}).items():
            make_folder(self.folder(taken) / TRACKS)
            write_atomic(self.folder(taken) / TRACKS / name, data)
        self.save_race(race)
        return race

    def save_race(self, race: Race) -> None:
        """Write a race.

        Raises:
            OutputFileError: The folder cannot be written.
        """
        write_atomic(self.folder(race.id) / RACE, _as_json(race))

    def folder(self, race: str) -> Path:
        """Return the folder of a race."""
        return self.path / RACES / race

    def tracks(self, race: str) -> dict[str, bytes]:
        """Return the files of the tracks that a race has kept, by name."""
        return {path.name: path.read_bytes() for path in sorted((self.folder(race) / TRACKS).glob("*"))}

    def track(self, race: str, name: str) -> str:
        """Return what a race's track is loaded by: the file that the race has kept, or its name."""
        kept = next((self.folder(race) / TRACKS).glob(f"{name}.*"), None)
        return name if kept is None else str(kept.resolve())

    def judging(self, race: str) -> FileLock:
        """Take the right to judge a race; one process has it at a time.

        Raises:
            UserInputError: Another process judges it.
        """
        return FileLock(
            self.folder(race) / "judge.lock",
            lambda holder: UserInputError(
                "{race}: another process judges it ({holder}); expected one judge. Wait for it, or stop it.",
                race=race,
                holder=holder,
            ),
        )

    def entries(self, race: str) -> Mapping[int, Entry]:
        """Return the entries of a race by their numbers, in order."""
        folder = self.folder(race) / ENTRIES
        return self._all_kept(folder, lambda name: folder / name / ENTRY, Entry, lambda entry: entry.number)

    def model(self, race: str, entry: int) -> Path:
        """Return the folder of an entry's model."""
        return self.folder(race) / ENTRIES / f"{entry:05}" / MODEL

    def add_entry(self, race: str, fill: Callable[[Path], Entry]) -> Entry:
        """Add an entry, whole or not at all.

        Args:
            race: Its race.
            fill: Copies the model into the folder it is given, and returns the entry; its number is set here.

        Raises:
            UserInputError: What `fill` raises; or there is no space for it.
        """
        folder = self.folder(race)
        make_folder(folder / ENTRIES)
        with tempfile.TemporaryDirectory(prefix=".new-", dir=folder, ignore_cleanup_errors=True) as draft:
            entry = fill(Path(draft) / MODEL)
            number = 1 + max([0, *_numbers(folder / ENTRIES), *_numbers(folder / WITHDRAWN)])
            while number <= MAX_ENTRIES:
                entry = replace(entry, number=number)
                write_atomic(Path(draft) / ENTRY, _as_json(entry))
                try:
                    os.rename(draft, folder / ENTRIES / f"{number:05}")
                    return entry
                except OSError as error:
                    if not (folder / ENTRIES / f"{number:05}").exists():
                        raise OutputFileError(output_error(folder / ENTRIES, error)) from error
                    number += 1
        raise SettingError("{race} has {count} entries, and takes no more.", race=race, count=MAX_ENTRIES)

    def withdraw(self, race: str, entry: int) -> None:
        """Take an entry and what it drove alone off the boards; its files are kept.

        Raises:
            SettingError: There is no such entry.
        """
        folder = self.folder(race)
        place = folder / ENTRIES / f"{entry:05}"
        if not place.is_dir():
            raise SettingError("{race} has no entry {entry}.", race=race, entry=entry)
        make_folder(folder / WITHDRAWN)
        target = folder / WITHDRAWN / f"{entry:05}"
        _move(place, target)
        if (result := folder / RESULTS / f"{entry:05}.json").is_file():
            _move(result, target / "result.json")

    def results(self, race: str) -> Mapping[str, Result]:
        """Return the results of a race by their heats, in order."""
        folder = self.folder(race) / RESULTS
        return self._all_kept(folder, lambda name: folder / name, Result, lambda result: result.heat)

    def save_result(self, race: str, result: Result, files: Mapping[int, Mapping[str, bytes]]) -> None:
        """Keep a result, and before it the files of its drives by the number of the track.

        Raises:
            OutputFileError: There is no space for it; the heat is then as if it had not been driven.
        """
        folder = self.folder(race)
        make_folder(folder / RESULTS)
        make_folder(folder / DRIVES)
        for track, contents in files.items():
            target = folder / DRIVES / f"{result.heat}-{track}"
            with tempfile.TemporaryDirectory(prefix=".new-", dir=folder, ignore_cleanup_errors=True) as draft:
                for name, data in contents.items():
                    make_folder((Path(draft) / name).parent)
                    write_atomic(Path(draft) / name, data)
                shutil.rmtree(target, ignore_errors=True)  # of a judge that was killed before it wrote the result
                _move(Path(draft), target)
        write_atomic(folder / RESULTS / f"{result.heat}.json", _as_json(result))

    def save_driving(self, race: str, driving: Driving | None) -> None:
        """Say which heat is driven now, and how far; None: none is. Nothing but what pages show depends on it."""
        with contextlib.suppress(OutputFileError, OSError):
            if driving is None:
                (self.folder(race) / DRIVING).unlink(missing_ok=True)
            else:
                write_atomic(self.folder(race) / DRIVING, _as_json(driving))

    def reset(self, race: str, heat: str | None = None) -> int:
        """Put results aside, so that their entries are judged again; return how many.

        Args:
            race: Its race.
            heat: One heat; None: all.
        """
        folder = self.folder(race)
        results = [one for one in self.results(race) if heat in (None, one)]
        if heat is not None and not results:
            raise SettingError("{race} has no result {heat!r}.", race=race, heat=heat)
        if results:
            make_folder(folder / PAST)
            past = folder / PAST / _take_name(folder / PAST, "reset")
            for name in results:
                _move(folder / RESULTS / f"{name}.json", past / f"{name}.json")
        return len(results)

    def seasons(self) -> list[Season]:
        """Return all seasons, the newest first."""
        found = (self._kept(file, Season) for file in (self.path / SEASONS).glob("*.json"))
        return sorted(found, key=lambda season: (-season.created, season.id))

    def season(self, id: str) -> Season:
        """Return a season.

        Raises:
            SettingError: There is none.
        """
        seasons = self.seasons()
        named = [one for one in seasons if id in (one.id, one.title)]
        if not named:
            hint = nearest(id, [one.id for one in seasons])
            raise SettingError("{league} has no season {id!r}. {hint}", league=self.path, id=id, hint=hint)
        return named[0]

    def add_season(self, season: Season) -> Season:
        """Keep a new season; return it with its id, made from its title."""
        make_folder(self.path / SEASONS)
        taken = {one.id for one in self.seasons()}
        id = next(name for name in _names(slug(season.title)) if name not in taken)
        season = replace(season, id=id)
        write_atomic(self.path / SEASONS / f"{id}.json", _as_json(season))
        return season

    def _all_kept(
        self, folder: Path, file_of: Callable[[str], Path], kind: type[Kept], key_of: Callable[[Kept], Key]
    ) -> Mapping[Key, Kept]:
        """Return what a folder holds by its key. A file is read once: it is replaced by a new one, never changed.

        The mapping is the same as long as the folder holds the same, and another one as soon as it does not.
        """
        state = _state(folder)
        before = self._folders.get(folder) or _Folder()
        if state is not None and state == before.state:
            return before.by_key
        names = _scanned(folder)
        if names == list(before.values):
            now = replace(before, state=state)
        else:
            values = {name: before.values.get(name) or read_kept(file_of(name[0]), kind) for name in names}
            now = _Folder(state, values, {key_of(value): value for value in values.values()})
        self._folders[folder] = now
        return now.by_key

    def _kept(self, file: Path, kind: type[Kept]) -> Kept:
        """Return what a file holds; it is read once."""
        try:
            stat = file.stat()
        except OSError as error:
            raise LeagueError(file, Message("cannot be read ({error})", error=error.strerror), "a file") from error
        state = (stat.st_mtime_ns, stat.st_size)
        before = self._read.get(file)
        if before is None or before[0] != state:
            self._read[file] = before = (state, read_kept(file, kind))
        value: Kept = before[1]
        return value


@cache
def shared_league(path: Path) -> League:
    """Return the league of a folder, the same to all who ask in this process: what one has read, none reads again.

    Raises:
        LeagueError: It is no league.
    """
    return League(path)


def read_kept(file: Path, kind: type[Kept]) -> Kept:
    """Return what a file of a league holds.

    Raises:
        LeagueError: It is missing, damaged or of a newer version.
    """
    expected = Message("a {kind} that racecraft wrote", kind=kind.__name__.lower())
    try:
        value = msgspec.json.decode(read_regular(file), type=kind)
    except OSError as error:
        raise LeagueError(file, Message("cannot be read ({error})", error=error.strerror), expected) from error
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise LeagueError(file, Message("damaged ({error})", error=error), expected, "Put a copy back.") from error
    if (version := getattr(value, "version", VERSION)) > VERSION:
        raise LeagueError(file, Message("version {version}", version=version), "version 1", "Upgrade racecraft.")
    return value


def slug(title: str) -> str:
    """Return a title as the name of a folder.

    >>> slug("Club evening, Oval!"), slug("夏のレース")
    ('club-evening-oval', 'race')
    """
    plain = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:60].strip("-") or "race"


def _as_json(value: Any) -> bytes:
    return msgspec.json.format(msgspec.json.encode(value), indent=2) + b"\n"


def _write_secret(path: Path) -> None:
    if path.is_file() and path.stat().st_size:
        return
    with atomic_file(path) as part:
        part.touch(0o600)
        part.write_text(secrets.token_hex(32))


def _names(name: str) -> Iterator[str]:
    yield name
    number = 2
    while True:
        yield f"{name}-{number}"
        number += 1


def _take_name(folder: Path, name: str) -> str:
    """Make the first folder of that name, or of that name with a number, that is free; return its name."""
    make_folder(folder)
    for free in _names(name):
        try:
            (folder / free).mkdir()
            return free
        except FileExistsError:
            continue
        except OSError as error:
            raise OutputFileError(output_error(folder / free, error)) from error
    raise AssertionError


def _state(folder: Path) -> tuple[int, int] | None:
    """Return what changes with a folder's entries; None where it changed a moment ago, and may change unseen."""
    try:
        stat = folder.stat()
    except OSError:
        return None
    is_settled = time.time_ns() - stat.st_mtime_ns > SETTLED_NS
    return (stat.st_ino, stat.st_mtime_ns) if is_settled else None


def _scanned(folder: Path) -> list[tuple[str, int]]:
    """Return what stands in a folder, (name, inode) by name; drafts and files that are no JSON are left out."""
    try:
        with os.scandir(folder) as entries:
            whole = [
                (one.name, one.inode())
                for one in entries
                if one.name.endswith(".json") or (one.name[0] != "." and one.is_dir())
            ]
    except FileNotFoundError:
        return []
    return sorted(whole)


def _numbers(folder: Path) -> list[int]:
    return [int(name) for name, _ in _scanned(folder) if name.isdigit()]


def _move(source: Path, target: Path) -> None:
    try:
        os.rename(source, target)
    except OSError as error:
        raise OutputFileError(output_error(target, error)) from error
