"""Judges races while the console runs, one heat at a time, in processes of their own. Begin with `RaceJudge`."""

from __future__ import annotations

import contextlib
import threading
import time
from functools import cache
from pathlib import Path

from racecraft.contract.errors import RacecraftError
from racecraft.league.heats import remaining
from racecraft.league.judging import Drivers, judge
from racecraft.league.store import MARK, League

WARM_SECONDS = 180.0
"""How long a warm process waits for a heat."""


class RaceJudge:
    """Drives what waits in the races it is told of. What is left when the console ends waits for the next one.

    Args:
        path: The league's folder; it need not exist.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._asked: list[str] = []
        self._wake = threading.Condition()
        self._drivers: dict[str, Drivers] = {}
        self._until = 0.0
        self._thread: threading.Thread | None = None
        self.faults: dict[str, str] = {}
        """Why a race could not be judged, by its id."""

    def judge(self, race: str) -> None:
        """Have a race judged as soon as the ones before it are done."""
        with self._wake:
            if race not in self._asked:
                self._asked.append(race)
            self.faults.pop(race, None)
            self._start()

    def judge_waiting(self) -> None:
        """Have every race judged in which an entry waits that needs no others: what a judge before left."""
        if not (self._path / MARK).is_file():
            return
        league = League(self._path)
        for race in league.races():
            waits = remaining(race, league.entries(race.id), league.results(race.id))
            if waits and not race.needs_all_entries:
                self.judge(race.id)

    def expect(self, kind: str) -> None:
        """Have a process of a world warm up: somebody is about to enter."""
        with self._wake:
            self._until = time.monotonic() + WARM_SECONDS
            self._of(kind).warm_up()
            self._start()

    def _start(self) -> None:
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=self._work, name="race judge", daemon=True)
            self._thread.start()
        self._wake.notify()

    def _of(self, kind: str) -> Drivers:
        return self._drivers.setdefault(kind, Drivers(kind))

    def _work(self) -> None:
        while True:
            with self._wake:
                while not self._asked:
                    left = self._until - time.monotonic()
                    if left <= 0:
                        self._end()
                        return
                    self._wake.wait(left)
                race = self._asked.pop(0)
            try:
                league = League(self._path)
                found = league.race(race)
                judge(league, found, drivers=self._of(found.kind))
            except RacecraftError as error:
                self.faults[race] = str(error)
            self._until = max(self._until, time.monotonic() + 1.0)

    def _end(self) -> None:
        self._thread = None
        for drivers in self._drivers.values():
            with contextlib.suppress(OSError):
                drivers.close()


@cache
def judge_of(league: Path) -> RaceJudge:
    """Return the only judge of a league in this process; it begins with what waits."""
    made = RaceJudge(league)
    made.judge_waiting()
    return made
