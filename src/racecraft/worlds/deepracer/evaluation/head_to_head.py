"""Races of cars against each other, as the original judges them. Begin with `race_head_to_head`.

Two or more drivers stand on one grid, 0.75 m behind one another, and drive so many laps of their own, each from its own
place. A car that leaves the road, drives backwards or stands still is set back on it and waits there; one that runs
into another car waits where it is, and whoever was hit drives on (facts: deepracer.md 5.2, 5.5, 6.3). Nobody can hit a
car that waits. A car that is done, or whose resets are used up, is carried off the road. The race is over with the
first car that finishes ("any"), or with the last ("all").

Several races are driven side by side. In each the drivers stand one place further back on the grid, the last one in
front, so that none keeps a better place; after as many races as there are drivers the grid moves round the track.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array, StepBuffers, allocate
from racecraft.settings.table import setting
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import OwnActions
from racecraft.worlds.deepracer.env.settings import HEAD_TO_MODEL, MAX_CARS, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import BODY_HALF_LENGTH_M, TICKS_PER_SECOND
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation.mishap_rules import MISHAPS, MishapRules
from racecraft.worlds.deepracer.evaluation.reset_pose import BoxResets, set_down
from racecraft.worlds.deepracer.players.driver import Driver
from racecraft.worlds.deepracer.players.seats import Seats
from racecraft.worlds.deepracer.tracks.track import Track

DONE_CONDITIONS = ("any", "all")
MAX_RACES = 10_000
KEPT_RACES = 16
"""Races whose ticks are kept, for films."""
FINISHED, RETIRED, TIME_UP, CUT_SHORT = "finished", "retired", "time_up", "not_finished"


@dataclass(frozen=True)
class HeadToHead(MishapRules):
    """How races of several cars are judged; names are those of DeepRacer for Cloud."""

    laps: int = setting(3, "Of every car.", low=1, high=1000)
    races: int | None = setting(
        None, "How many; None: as many as cars, so that each stands on every place of the grid once.",
        low=1, high=MAX_RACES,
    )  # fmt: skip
    done_condition: str = setting(
        "all", "A race is over with the first car that finishes, or with the last.", choices=DONE_CONDITIONS
    )


@dataclass
class DriverResult:
    """What a driver came to in a race."""

    driver: str
    grid: int
    """Its place at the start, 1 in front."""
    place: int = 0
    """1 for the winner; equal where nothing tells two apart."""
    seconds: float | None = None
    """Simulated seconds of all laps, penalties in; None where they were not finished."""
    laps: float = 0.0
    """Driven, with the share of the last."""
    ended: str = ""
    """"finished", "retired", "time_up", or "not_finished" where the race was over before."""
    overtakes: int = 0
    """Cars under way that it passed, by more than a car's length."""
    overtaken: int = 0
    crashes: int = 0
    """How often it ran into another car."""
    was_hit: int = 0
    """How often another car ran into it."""
    off_tracks: int = 0
    """How often it left the road, drove backwards or stood still."""


@dataclass(frozen=True, eq=False)
class RaceResult:
    """Races of the same drivers."""

    drivers: tuple[str, ...]
    races: tuple[tuple[DriverResult, ...], ...]
    """In each, the drivers in their own order."""
    ticks: tuple[Array, ...]
    """TICK_REPORT (T, M) of each of the first KEPT_RACES races, in the order of the drivers."""

    def of(self, number: int) -> list[DriverResult]:
        """Return what a driver came to, race by race."""
        return [one[number] for one in self.races]

    @property
    def overtakes_per_race(self) -> float:
        """How often, in a race, one of its cars passed another that was under way."""
        return sum(showing.overtakes for one in self.races for showing in one) / len(self.races)

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures as plain values, fit for JSON."""
        return {
            "overtakes_per_race": round(self.overtakes_per_race, 3),
            "drivers": [summed(name, self.of(number)) for number, name in enumerate(self.drivers)],
            "races": [[asdict(showing) for showing in one] for one in self.races],
        }


def summed(name: str, showings: Sequence[DriverResult]) -> dict[str, Any]:
    """Return a driver's figures over all races."""
    times = [one.seconds for one in showings if one.seconds is not None]
    counts = ("overtakes", "overtaken", "crashes", "was_hit", "off_tracks")
    return {
        "driver": name,
        "races": len(showings),
        "wins": sum(one.place == 1 for one in showings),
        "mean_place": round(float(np.mean([one.place for one in showings])), 3),
        "finishes": len(times),
        "mean_seconds": round(float(np.mean(times)), 3) if times else None,
        **{count: sum(getattr(one, count) for one in showings) for count in counts},
        "overtakes_per_race": round(sum(one.overtakes for one in showings) / len(showings), 3),
    }


def race_head_to_head(
    drivers: Sequence[Driver],
    track: Track,
    rules: HeadToHead,
    config: RaceConfig | None = None,
    seed: int = 0,
    watch: Callable[[float, Array], None] = lambda share, reports: None,
) -> RaceResult:
    """Let drivers race each other, greedily.

    Args:
        drivers: 2 to MAX_CARS of them. The world is drawn as the first one sees it.
        track: Where.
        rules: How it is judged.
        config: How the world is: fidelity, direction, time; None: as usual.
        seed: Of what chance does to the cars, where it does.
        watch: Called after each tick with the share that is driven, 0 to 1, and each driver's TICK_REPORT (M,) of the
            first race.

    Raises:
        SettingError: Too few or too many drivers, or one that cannot see in this company.
    """
    require_company(len(drivers))
    field = _Field(drivers, track, rules, config or RaceConfig())
    field.place_on_grid(seed)
    while not field.is_over:
        field.tick()
        watch(field.share, field.first_race)
    return field.result()


def require_company(count: int) -> None:
    """Refuse a race of one car, or of too many.

    Raises:
        SettingError: So many cannot race.
    """
    if not 2 <= count <= MAX_CARS:
        raise SettingError(
            "{count} cars were named for one race; expected 2 to {most_cars}.", count=count, most_cars=MAX_CARS
        )


class _Field:
    """Races side by side while they are driven."""

    def __init__(self, drivers: Sequence[Driver], track: Track, rules: HeadToHead, config: RaceConfig) -> None:
        count, races = len(drivers), rules.races or len(drivers)
        self._rules, self._drivers = rules, drivers
        self.whose = (np.arange(count)[None, :] + np.arange(races)[:, None]) % count
        """(N, M) which driver stands where on which grid."""
        rounds = -(-races // count)
        self._world = RaceWorld(
            track,
            OwnActions(tuple(driver.actions for driver in drivers), self.whose),
            race_config=replace(config, type=HEAD_TO_MODEL, change_start=False),
            camera_config=drivers[0].frame,
            num_cars=races,
            start_shares=(np.arange(races) // count) / rounds,
            laps=rules.laps,
            mount=drivers[0].mount,
            sensors=drivers[0].sensors,
            cars_per_world=count,
        )
        self._seats = Seats(self._world, drivers[0], drivers, self.whose)
        self._buffers: StepBuffers = allocate(self._world.spec)
        self._actions = np.zeros((races, count, 2))
        self._out = np.zeros((races, count), bool)
        self._resets_left = np.full((races, count), rules.max_resets)
        self._shown = [
            [DriverResult(drivers[one].name, place + 1) for place, one in enumerate(row)] for row in self.whose
        ]
        self._order = np.zeros((races, count, count), np.int8)
        self._driven = np.zeros((races, count))
        self._arcs = np.zeros((races, count))
        self._logs: list[list[Array]] = [[] for _ in range(min(races, KEPT_RACES))]

    @property
    def is_over(self) -> bool:
        """Nobody drives any more."""
        return bool(self._out.all())

    @property
    def share(self) -> float:
        """How much of all races is driven, 0 to 1."""
        whole = self._rules.laps * self._world.track.length
        return float(np.where(self._out, 1.0, np.clip(self._driven / whole, 0.0, 1.0)).mean())

    @property
    def first_race(self) -> Array:
        """TICK_REPORT (M,) of each driver in the first race."""
        reports: Array = self._world.reports[0, np.argsort(self.whose[0])]
        return reports

    def place_on_grid(self, seed: int) -> None:
        """Put every car on its grid."""
        self._world.reset(self._buffers, seed)
        self._seats.reset_state(np.ones_like(self._out))
        cars, length = self._world.cars, self._world.track.length
        first = cars["arc"][:, :1]
        self._driven = -np.mod(first - cars["arc"], length)
        self._arcs = cars["arc"].copy()
        self._order = self._ahead()

    def tick(self) -> None:
        """Drive on, and judge what came of it."""
        before = self._world.cars
        self._seats.choose(self._buffers.observations, self._actions)
        self._world.step(self._actions, self._buffers)
        reports = self._world.reports
        for n, log in enumerate(self._logs):
            if not self._out[n].all():
                log.append(reports[n, np.argsort(self.whose[n])].copy())
        self._count_contacts(reports)
        self._count_overtakes(reports)
        self._judge(reports, before)

    def result(self) -> RaceResult:
        """Return what every driver came to."""
        for row in self._shown:
            _place(row)
        ordered = tuple(
            tuple(row[place] for place in np.argsort(own)) for row, own in zip(self._shown, self.whose, strict=True)
        )
        return RaceResult(tuple(driver.name for driver in self._drivers), ordered, tuple(map(np.array, self._logs)))

    def _judge(self, reports: Array, before: Array) -> None:
        """End cars' races, and set back those that go on."""
        ended = (reports["terminated"] | reports["truncated"]) & ~self._out
        back: dict[tuple[int, int], Array] = {}
        for n, m in np.argwhere(ended).tolist():
            report, shown = reports[n, m], self._shown[n][m]
            status = int(report["status"])
            if status == race.LAP_COMPLETE:
                shown.seconds = round(float(before[n, m]["ticks"] + 1) / TICKS_PER_SECOND, 6)
                self._leave(n, m, report, FINISHED)
            elif status not in MISHAPS:
                self._leave(n, m, report, TIME_UP)
            else:
                shown.crashes += status == race.CRASHED
                shown.off_tracks += status != race.CRASHED
                self._resets_left[n, m] -= 1
                if self._resets_left[n, m] < 0:
                    self._leave(n, m, report, RETIRED)
                else:
                    back[n, m] = self._set_back(n, before[n, m : m + 1], status)
        if self._rules.done_condition == "any":
            for n in {n for n, m in np.argwhere(ended).tolist() if self._shown[n][m].ended == FINISHED}:
                for m in np.flatnonzero(~self._out[n]).tolist():
                    self._leave(n, m, reports[n, m], CUT_SHORT)
        if back:
            self._write(back)
        if ended.any():
            self._seats.reset_state(ended)
            self._world.freeze(self._out)

    def _set_back(self, n: int, car: Array, status: int) -> Array:
        """Return a car as it goes on after a mishap, CAR_STATE (1,): on the road, at rest, waiting."""
        car = car.copy()
        if status == race.CRASHED:  # where it is; on the road it is still
            for name in ("speed", "steering", "old_steering", "old_speed", "still_ticks", "backward_ticks"):
                car[name] = 0
        else:
            set_down(self._world, car, n, crashed=False, resets=BoxResets(behind_m=0.0))
        for name in ("ticks", "lap_ticks", "total_ticks"):  # the tick of the mishap counts
            car[name] += 1
        car["held"] = self._rules.waiting_ticks(status)
        return car

    def _write(self, back: Mapping[tuple[int, int], Array]) -> None:
        """Put cars where they go on, and look again."""
        state = self._world.save_state()
        for (n, m), car in back.items():
            for name in race.CAR_STATE.names or ():
                state[f"car.{name}"][n, m] = car[name][0]
        self._world.load_state(state, self._buffers)
        self._world.freeze(self._out)

    def _leave(self, n: int, m: int, report: Array, how: str) -> None:
        laps = float(report["laps"])
        part = 0.0 if report["status"] == race.LAP_COMPLETE else min(max(float(report["progress"]), 0.0), 100.0)
        self._shown[n][m].laps = round(laps + part / 100.0, 4)
        self._shown[n][m].ended = how
        self._out[n, m] = True

    def _count_contacts(self, reports: Array) -> None:
        """Count, for every car that crashed, whom it hit."""
        for n, m in np.argwhere(reports["is_crashed"] & ~self._out).tolist():
            others = [other for other in range(reports.shape[1]) if other != m and not self._out[n, other]]
            self._shown[n][others[int(reports[n, m]["object_hit"])]].was_hit += 1

    def _count_overtakes(self, reports: Array) -> None:
        """Count who is now ahead, by a car's length, of whom it was behind."""
        length = self._world.track.length
        step = np.mod(reports["arc"] - self._arcs + length / 2, length) - length / 2
        going = ~self._out
        self._driven += np.where(going, step, 0.0)
        self._arcs = np.where(going, reports["arc"], self._arcs)
        now = self._ahead()
        both = going[:, :, None] & going[:, None, :]
        turned = (now != self._order) & (now != 0) & both
        under_way = (reports["status"] != race.PAUSE)[:, None, :]
        for n, m, other in np.argwhere(turned & (now > 0) & under_way).tolist():
            self._shown[n][m].overtakes += 1
            self._shown[n][other].overtaken += 1
        self._order = np.where(turned, now, self._order)

    def _ahead(self) -> Array:
        """Return who is ahead of whom on the road, (N, M, M): 1 ahead, -1 behind, 0 where less than a car's length."""
        gap = self._driven[:, :, None] - self._driven[:, None, :]
        return (np.sign(gap) * (np.abs(gap) > 2.0 * BODY_HALF_LENGTH_M)).astype(np.int8)


def _place(row: Sequence[DriverResult]) -> None:
    """Write places down: who finished, by time; behind them the others, by how far they came."""

    def merit(one: DriverResult) -> tuple[bool, float]:
        return (one.seconds is not None, -one.seconds if one.seconds is not None else one.laps)

    for one in row:
        one.place = 1 + sum(merit(other) > merit(one) for other in row)
