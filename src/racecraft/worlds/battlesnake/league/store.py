"""The one file in which an arena lies, and its one promise. See `ArenaStore`.

It is SQLite's, over the standard library: an arena is a file on one machine whose games one process writes, so nothing
that a database server or SQLAlchemy offers is of use to it, and any program that reads SQLite can read it.

    about       key, value                 the terms, as JSON
    players     number, name, source, …    in the order in which they came; none is ever taken out
    meetings    number, players            who was drawn to meet, as JSON
    games       number, meeting, …, record record: the official output file of the game, gzipped
    seats       game, seat, player, place, timeouts, crashes
"""

from __future__ import annotations

import contextlib
import gzip
import json
import sqlite3
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields
from itertools import groupby
from pathlib import Path
from typing import Any

from racecraft.contract.errors import nearest
from racecraft.formats.run_lock import FileLock, holder_of
from racecraft.worlds.battlesnake.league.terms import ArenaError, ArenaGame, ArenaTerms, Entrant, Meeting

APPLICATION, VERSION = 0x52434152, 1
"""What SQLite keeps in the head of the file: that it is an arena ("RCAR"), and in which shape."""
PATIENCE_SECONDS = 30.0
"""How long a statement waits for others that write."""

_SHAPE = """
    create table about (key text primary key, value text not null);
    create table players (
        number integer primary key, name text not null unique, source text not null, fingerprint text not null,
        is_anchor integer not null, rests integer not null, since real not null
    );
    create table meetings (number integer primary key, players text not null);
    create table games (
        number integer primary key, meeting integer not null references meetings, rotation integer not null,
        turns integer not null, ended real not null, record blob not null, unique (meeting, rotation)
    );
    create table seats (
        game integer not null references games, seat integer not null, player integer not null references players,
        place integer not null, timeouts integer not null, crashes integer not null, primary key (game, seat)
    ) without rowid;
"""


class ArenaStore:
    """Holds an arena.

    What `add`, `rest` or `keep` has taken is there for every later reader and survives the process that wrote it, a
    game with all its seats or not at all. Any thread and process may call it: each call opens the file for itself.
    Who plays holds `lock`, so that no two draw meetings side by side.

    Args:
        path: An arena that there is; `begin` makes one.

    Raises:
        ArenaError: There is none, or something else; says what.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            raise ArenaError(
                "{path}: there is no arena; expected one that `racecraft snakes arena new` made. "
                "`racecraft snakes arena new --arena {path}` begins it.",
                path=path,
            )
        with self._open() as database:
            pragmas = [database.execute(f"pragma {name}").fetchone()[0] for name in ("application_id", "user_version")]
            if pragmas[0] != APPLICATION:
                raise ArenaError("{path}: another program's database; expected an arena of racecraft's.", path=path)
            if pragmas[1] != VERSION:
                raise ArenaError(
                    "{path}: an arena of version {told}; expected {version}. Another racecraft made it: use that.",
                    path=path,
                    told=pragmas[1],
                    version=VERSION,
                )
            terms = json.loads(database.execute("select value from about where key = 'terms'").fetchone()[0])
        self.terms = ArenaTerms(**terms | {"snakes": tuple(terms["snakes"])})

    @classmethod
    def begin(cls, path: str | Path, terms: ArenaTerms) -> ArenaStore:
        """Make an empty arena.

        Raises:
            ArenaError: Something stands there already, or the place cannot be written.
        """
        path = Path(path)
        if path.exists():
            raise ArenaError(
                "{path}: something stands there; expected a new place. Give another --arena, or move it away: "
                "an arena's terms never change.",
                path=path,
            )
        with _connected(path) as database:
            database.executescript(_SHAPE)
            database.execute("insert into about values ('terms', ?)", [json.dumps(asdict(terms))])
            database.execute(f"pragma application_id = {APPLICATION}")
            database.execute(f"pragma user_version = {VERSION}")
            database.commit()
        return cls(path)

    def lock(self) -> FileLock:
        """Take the right to play; it is free again when its holder releases it, or is gone.

        Raises:
            ArenaError: Somebody plays here already.
        """
        return FileLock(
            self._lock_file,
            lambda holder: ArenaError(
                "{path}: somebody plays in it already ({holder}); expected an arena at rest. Wait for it or "
                "stop it (Ctrl-C); `arena add`, `remove`, `show` and `board` work meanwhile.",
                path=self.path,
                holder=holder,
            ),
        )

    @property
    def is_playing(self) -> bool:
        """Whether somebody plays here just now."""
        return holder_of(self._lock_file) is not None

    def add(self, entrant: Entrant) -> Entrant:
        """Let a player in; return it with its number and the time.

        Raises:
            ArenaError: The name is taken.
        """
        with self._open() as database:
            database.execute("begin immediate")
            (count,) = database.execute("select count(*) from players").fetchone()
            row = asdict(entrant) | {"number": count, "since": time.time()}
            try:
                database.execute(
                    "insert into players values (:number, :name, :source, :fingerprint, :is_anchor, :rests, :since)",
                    row,
                )
            except sqlite3.IntegrityError:
                raise ArenaError(
                    "There is a player '{name}' in this arena already; expected a new name. Give one with --name.",
                    name=entrant.name,
                ) from None
            database.commit()
        return Entrant(**row)

    def set_rest(self, entrant: Entrant, rests: bool) -> None:
        """Draw a player no more, or again."""
        with self._open() as database:
            database.execute("update players set rests = ? where number = ?", [rests, entrant.number])
            database.commit()

    def entrants(self) -> list[Entrant]:
        """Return all players, in the order of their numbers."""
        names = ", ".join(field.name for field in fields(Entrant))
        with self._open() as database:
            rows = database.execute(f"select {names} from players order by number").fetchall()
        return [
            Entrant(number, name, source, fingerprint, bool(is_anchor), bool(rests), since)
            for number, name, source, fingerprint, is_anchor, rests, since in rows
        ]

    def find(self, name: str) -> Entrant:
        """Return the player of a name.

        Raises:
            ArenaError: There is none; the nearest name is told.
        """
        there = {one.name: one for one in self.entrants()}
        if name not in there:
            raise ArenaError(
                "There is no player '{name}' in this arena. {hint}", name=name, hint=nearest(name, list(there))
            )
        return there[name]

    def draw(self, players: Sequence[int]) -> Meeting:
        """Write down who meets next."""
        with self._open() as database:
            cursor = database.execute("insert into meetings (players) values (?)", [json.dumps(list(players))])
            database.commit()
        return Meeting(int(cursor.lastrowid or 0), tuple(players))

    def last_meeting(self) -> tuple[Meeting, int] | None:
        """Return the meeting drawn last, and how many of its games were played; None before the first."""
        with self._open() as database:
            row = database.execute("select number, players from meetings order by number desc limit 1").fetchone()
            if row is None:
                return None
            (played,) = database.execute("select count(*) from games where meeting = ?", [row[0]]).fetchone()
        return Meeting(row[0], tuple(json.loads(row[1]))), played

    def keep(self, game: ArenaGame, record: str) -> ArenaGame:
        """Take a game that was played; return it with its number.

        Args:
            game: The game; its number does not matter.
            record: The official output file of it.
        """
        zipped = gzip.compress(record.encode(), mtime=0)
        with self._open() as database:
            cursor = database.execute(
                "insert into games (meeting, rotation, turns, ended, record) values (?, ?, ?, ?, ?)",
                [game.meeting, game.rotation, game.turns, game.ended, zipped],
            )
            number = int(cursor.lastrowid or 0)
            columns = zip(game.players, game.places, game.timeouts, game.crashes, strict=True)
            database.executemany(
                "insert into seats values (?, ?, ?, ?, ?, ?)",
                [(number, seat, *cursor) for seat, cursor in enumerate(columns)],
            )
            database.commit()
        return ArenaGame(**asdict(game) | {"number": number})

    def games(self, after: int = 0) -> list[ArenaGame]:
        """Return the games behind the one of a number, in the order in which they were played."""
        with self._open() as database:
            rows = database.execute(
                "select number, meeting, rotation, turns, ended, player, place, timeouts, crashes from games "
                "join seats on game = number where number > ? order by number, seat",
                [after],
            ).fetchall()
        return [_game(head, [row[5:] for row in seats]) for head, seats in groupby(rows, key=lambda row: row[:5])]

    def record(self, number: int) -> str:
        """Return the official output file of a game.

        Raises:
            ArenaError: There is no such game.
        """
        with self._open() as database:
            row = database.execute("select record from games where number = ?", [number]).fetchone()
            (last,) = database.execute("select max(number) from games").fetchone()
        if row is None:
            there = f"expected 1 to {last}" if last else "none was played yet: `racecraft snakes arena play`"
            raise ArenaError("There is no game {number} in this arena; {there}.", number=number, there=there)
        return gzip.decompress(row[0]).decode()

    @property
    def _lock_file(self) -> Path:
        return self.path.with_name(self.path.name + ".lock")

    def _open(self) -> contextlib.AbstractContextManager[sqlite3.Connection]:
        return _connected(self.path)


@contextlib.contextmanager
def _connected(path: Path) -> Iterator[sqlite3.Connection]:
    """Open the file for a few statements, and turn what SQLite raises into errors."""
    try:
        with contextlib.closing(sqlite3.connect(path, timeout=PATIENCE_SECONDS)) as database:
            yield database
    except sqlite3.Error as error:
        raise ArenaError("{path}: {what_happened}", path=path, what_happened=_what_happened(str(error))) from error


def _what_happened(event: str) -> str:
    if "full" in event:
        return f"the disk is full ({event}); nothing was changed there. Free some space and run the same command again."
    if "not a database" in event or "malformed" in event or "no such table" in event:
        return f"no arena ({event}); expected one that `racecraft snakes arena new` made."
    if "readonly" in event or "unable to open" in event:
        return f"cannot be opened or written ({event}); expected a place that you may write to."
    if "locked" in event:
        return f"others have been writing to it for {PATIENCE_SECONDS:g} s ({event}); try again."
    return f"the database refuses ({event}); expected an arena that `racecraft snakes arena new` made."


def _game(head: Sequence[Any], seats: Sequence[Sequence[Any]]) -> ArenaGame:
    number, meeting, rotation, turns, ended = head
    players, places, timeouts, crashes = (tuple(column) for column in zip(*seats, strict=True))
    return ArenaGame(number, players, places, turns, timeouts, crashes, meeting, rotation, ended)
