"""Which races changed since one looked last, and what is driven in them, by their files. Begin with `RaceWatch`."""

from __future__ import annotations

import contextlib
import os
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from racecraft.league.race import Driving
from racecraft.league.store import DRIVING, ENTRIES, RACE, RACES, RESULTS, LeagueError, read_kept

LOOK_SECONDS = 0.5
LEFT_SECONDS = 10.0
"""A heat of which nothing was told for so long was left by a judge that is no more."""


class RaceWatch:
    """Looks at a league's folder, whoever writes there: a judge, a command, a page.

    Args:
        league: The folder; it need not exist.
        only: Id of the only race that is looked at; "": all.
    """

    def __init__(self, league: Path, only: str = "") -> None:
        self._races, self._only = league / RACES, only
        self._before: dict[str, tuple[int, ...]] | None = None

    def changed(self) -> dict[str, Any] | None:
        """Return the ids of the races that changed since the last call; None: none did, or it is the first call."""
        now = {name: self._times(name) for name in self._names()}
        before, self._before = self._before, now
        if before is None or before == now:
            return None
        names = sorted({name for name in now.keys() | before.keys() if now.get(name) != before.get(name)})
        return {"changed": names, "times": [now.get(name) for name in names]}

    def driving(self) -> dict[str, Any]:
        """Return the heats that are driven now, by the ids of their races."""
        found = {}
        for file in (self._races / name / DRIVING for name in self._names()):
            with contextlib.suppress(OSError, LeagueError):
                if time.time() - file.stat().st_mtime < LEFT_SECONDS:
                    found[file.parent.name] = asdict(read_kept(file, Driving))
        return found

    def _names(self) -> list[str]:
        if self._only:
            return [self._only]
        try:
            return sorted(os.listdir(self._races))
        except OSError:
            return []

    def _times(self, name: str) -> tuple[int, ...]:
        return tuple(_changed_at(self._races / name / part) for part in (RACE, ENTRIES, RESULTS))


def _changed_at(path: Path) -> int:
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0
