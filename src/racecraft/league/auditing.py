"""Judged heats driven again by their recorded actions. Begin with `audit`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields
from types import TracebackType

from racecraft.league.drive_process import DriveError, DriveProcess
from racecraft.league.judging import machine
from racecraft.league.race import Race, Result
from racecraft.league.store import RACES, League
from racecraft.league.world_part import DriveOrder

HEATS_OF_PROCESS = 200
"""A process is replaced after so many heats."""


@dataclass(frozen=True)
class AuditedHeat:
    """A heat that was driven again."""

    race: str
    heat: str
    is_equal: bool
    """Every tick was the same, bit for bit."""
    differences: tuple[str, ...] = ()
    """What differs, a clause each."""
    is_other_machine: bool = False
    """It was judged on another machine or version, where bits may differ."""


def audit(
    league: League, races: Iterable[Race], on_progress: Callable[[int, int], None] = lambda done, all: None
) -> Iterator[AuditedHeat]:
    """Drive every judged heat of races again, and yield what came of each.

    Args:
        league: Where the races are.
        races: Which.
        on_progress: Is called with how many heats are done, and how many there are.
    """
    work = [(race, result) for race in races for result in league.results(race.id).values() if result.drives]
    with _Process(league) as process:
        for done, (race, result) in enumerate(work, start=1):
            differences = tuple(_differences(league, race, result, process.of(race.kind)))
            if any(one.startswith("cannot be driven again") for one in differences):
                process.close()
            is_other = result.machine != machine()
            yield AuditedHeat(race.id, result.heat, not differences, differences, bool(differences) and is_other)
            on_progress(done, len(work))


class _Process:
    """The process that drives, replaced now and then: after many heats, after a failure, for another world."""

    def __init__(self, league: League) -> None:
        self._readable = [(league.path / RACES).resolve()]
        self._process: DriveProcess | None = None
        self._kind, self._heats = "", 0

    def __enter__(self) -> _Process:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def of(self, kind: str) -> DriveProcess:
        """Return a process of a world for the next heat."""
        if kind != self._kind or self._heats >= HEATS_OF_PROCESS:
            self.close()
        if self._process is None:
            self._process, self._kind, self._heats = DriveProcess(kind, self._readable), kind, 0
        self._heats += 1
        return self._process

    def close(self) -> None:
        """End it."""
        if self._process is not None:
            self._process.close()
        self._process = None


def _differences(league: League, race: Race, result: Result, process: DriveProcess) -> Iterator[str]:
    models = tuple(str(league.model(race.id, number).resolve()) for number in result.entries)
    for drive in result.drives:
        order = DriveOrder(
            rules=race.rules,
            track=league.track(race.id, drive.track),
            seed=drive.seed,
            models=models,
            names=tuple(map(str, result.entries)),
        )
        try:
            driven = process.drive(order, (league.folder(race.id) / drive.folder).resolve())
        except DriveError as error:
            yield f"cannot be driven again: {error}"
            continue
        for number, before, after in zip(result.entries, drive.outcomes, driven.outcomes, strict=True):
            if before.laps != after.laps:
                yield f"entry {number} on {drive.track}: laps {_laps(before.laps)}, now {_laps(after.laps)}"
            elif before != after:
                names = [one.name for one in fields(before) if getattr(before, one.name) != getattr(after, one.name)]
                yield f"entry {number} on {drive.track}: laps are equal, {', '.join(names)} differ"


def _laps(laps: tuple[float | None, ...]) -> str:
    return " ".join("–" if lap is None else f"{lap:.6f}" for lap in laps)
