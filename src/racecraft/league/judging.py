"""The league drives what was entered. Begin with `judge`.

What is to do follows from the files alone (`heats.py`), and a heat counts when its result stands. So a judge that is
killed loses the heat it was driving, which the next judge drives again on the same seed.
"""

from __future__ import annotations

import contextlib
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from types import TracebackType

from racecraft.contract.errors import SettingError
from racecraft.league.drive_process import DriveError, DriveProcess
from racecraft.league.heats import Heat, next_heat, remaining
from racecraft.league.race import Drive, Driving, Places, Race, Result
from racecraft.league.store import TRACKS, League
from racecraft.league.world_part import DriveOrder

BITS_DEPEND_ON = ("racecraft", "numpy", "numba", "torch")


@dataclass(frozen=True)
class JudgedHeat:
    """A heat that was judged."""

    heat: Heat
    result: Result


def judge(
    league: League,
    race: Race,
    max_heats: int | None = None,
    drivers: Drivers | None = None,
    on_heat: Callable[[JudgedHeat], None] = lambda judged: None,
) -> list[JudgedHeat]:
    """Drive every heat that has no result; each in a process of its own.

    Args:
        league: Where the race is.
        race: Which.
        max_heats: Stop after so many; None: when all are driven.
        drivers: Processes that may be warm already; they stay open. None: new ones.
        on_heat: Is called after each.

    Raises:
        UserInputError: Another process judges the race; or it needs all entries first, and still takes some.
    """
    if race.needs_all_entries and race.is_open(time.time()):
        raise SettingError(
            "{race} still takes entries, and who meets whom depends on all of them; expected a closed race. "
            "racecraft league close {race}",
            race=race.id,
        )
    judged: list[JudgedHeat] = []
    own = contextlib.nullcontext(drivers) if drivers is not None else Drivers(race.kind)
    with league.judging(race.id), own as processes:
        while max_heats is None or len(judged) < max_heats:
            entries, results = league.entries(race.id), league.results(race.id)
            heat = next_heat(race, entries, results)
            if heat is None:
                break
            more = remaining(race, entries, results) > 1 and len(judged) + 1 != max_heats
            with processes.acquire(more) as process:
                judged.append(JudgedHeat(heat, _judge_heat(league, race, heat, process)))
            on_heat(judged[-1])
    return judged


class Drivers:
    """Processes for one heat each; the next one warms up while one drives.

    Args:
        kind: Whose world.
    """

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self._spare: DriveProcess | None = None

    def __enter__(self) -> Drivers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the process that waits, if one does."""
        if self._spare is not None:
            self._spare.close()
            self._spare = None

    def warm_up(self) -> None:
        """Have a process wait for the next heat."""
        self._spare = self._spare or DriveProcess(self._kind)

    @property
    def is_warm(self) -> bool:
        """Whether a process waits that has imported and compiled what a drive needs."""
        return self._spare is not None and self._spare.is_warm

    def acquire(self, more: bool) -> DriveProcess:
        """Return a process that has driven nothing; `more`: another one will be needed."""
        process = self._spare or DriveProcess(self._kind)
        self._spare = DriveProcess(self._kind) if more else None
        return process


def _judge_heat(league: League, race: Race, heat: Heat, process: DriveProcess) -> Result:
    started, entries = time.perf_counter(), league.entries(race.id)
    names = tuple(entries[number].racer for number in heat.entries)
    models = tuple(str(league.model(race.id, number).resolve()) for number in heat.entries)
    drives: list[Drive] = []
    files, failure = {}, ""

    def on_progress(share: float, text: str, places: Places = ()) -> None:
        track, count = len(drives), len(race.tracks)
        league.save_driving(
            race.id, Driving(racers=names, share=(track + share) / count, text=text, track=track, places=places)
        )

    on_progress(0.0, "")
    try:
        for index, track in enumerate(race.tracks):
            seed = league.seed(race.id, heat.name, index)
            order = DriveOrder(
                rules=race.rules, track=league.track(race.id, track), seed=seed, models=models, names=names,
                files=(str((league.folder(race.id) / TRACKS).resolve()),),
            )  # fmt: skip
            driven = process.drive(order, on_progress=on_progress)
            drives.append(Drive(track=track, seed=seed, outcomes=driven.outcomes, folder=f"drives/{heat.name}-{index}"))
            files[index] = driven.files
    except DriveError as error:
        drives, files, failure = [], {}, str(error)
    finally:
        league.save_driving(race.id, None)
    result = Result(
        heat=heat.name,
        entries=heat.entries,
        drives=tuple(drives),
        judged=time.time(),
        seconds=round(time.perf_counter() - started, 3),
        machine=machine(),
        limits=process.layers,
        failure=failure,
        round=heat.round,
    )
    league.save_result(race.id, result, files)
    return result


def machine() -> str:
    """Return what the bits of a drive depend on: processor, system, versions."""
    return "; ".join([platform.machine(), _processor(), platform.system(), *map(_version, BITS_DEPEND_ON)])


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            return next((line.partition(":")[2].strip() for line in file if line.startswith("model name")), "")
    except OSError:
        return platform.processor()


def _version(package: str) -> str:
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:
        return f"{package} -"
