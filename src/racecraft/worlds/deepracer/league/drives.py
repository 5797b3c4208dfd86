"""Cars drive a heat: alone, or against each other. Begin with `drive_cars`.

What the policies choose is recorded. The same actions on the same seed give the same drive, bit for bit, on the same
machine and versions (`redrive_cars`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array
from racecraft.formats.tensor_file import digest
from racecraft.league.race import Outcome, Places
from racecraft.league.world_part import OnProgress, no_progress
from racecraft.settings.composition import Settings
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.settings import race_groups
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.evaluation.head_to_head import RaceResult, race_head_to_head
from racecraft.worlds.deepracer.evaluation.trial_race import RaceRecord, judge_race
from racecraft.worlds.deepracer.league.rules import CarRules
from racecraft.worlds.deepracer.players.driver import driver_of
from racecraft.worlds.deepracer.players.trained_car import TrainedCar
from racecraft.worlds.deepracer.tracks.track import Track

ACTIONS, COUNTS = "actions", "counts"


class Recorder:
    """A policy that keeps what another one chooses."""

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self._chosen: list[Array] = []

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Choose an action for every row."""
        chosen = np.asarray(self._policy.act(observations, action_mask))
        self._chosen.append(chosen.copy())
        return chosen

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        self._policy.reset_state(rows)

    @property
    def actions(self) -> dict[str, Array]:
        """Every choice, one after the other (R, …), and how many rows each call had, int64 (calls,)."""
        counts = np.array([len(one) for one in self._chosen], np.int64)
        return {ACTIONS: np.concatenate(self._chosen), COUNTS: counts}


class Player:
    """A policy that chooses what was recorded, and nothing once that is used up."""

    def __init__(self, actions: Mapping[str, Array]) -> None:
        ends = np.cumsum(actions[COUNTS])
        self.actions = actions
        self._chosen = np.split(actions[ACTIONS], ends[:-1])
        self._call = 0

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return the next recorded choice; the last one again behind the end."""
        chosen: Array = self._chosen[min(self._call, len(self._chosen) - 1)]
        self._call += 1
        rows = len(next(iter(observations.values())))
        return chosen if len(chosen) == rows else np.resize(chosen, (rows, *chosen.shape[1:]))

    def reset_state(self, rows: Array) -> None:
        """Nothing is remembered."""


@dataclass(frozen=True, eq=False)
class CarDrive:
    """What one car did in a heat."""

    car: TrainedCar
    outcome: Outcome
    ticks: Array
    """TICK_REPORT (T,); of cars that met each other, of their first race."""
    actions: Mapping[str, Array]
    """As `Recorder.actions`."""
    record: RaceRecord | None
    """Of a car alone."""
    track: Track
    """In driving direction."""
    meeting: RaceResult | None = None
    """Of cars that met each other: their races."""


def drive_cars(
    cars: Sequence[TrainedCar],
    names: Sequence[str],
    track: Track,
    rules: CarRules,
    seed: int,
    recorded: Sequence[Mapping[str, Array]] | None = None,
    on_progress: OnProgress = no_progress,
) -> list[CarDrive]:
    """Let cars drive a heat.

    Args:
        cars: One alone, or two or more against each other.
        names: Of the racers.
        track: Where.
        rules: How.
        seed: Of what chance does: places of boxes, lane changes of bots.
        recorded: Actions of an earlier drive, car by car, which are driven again; None: the policies choose.
        on_progress: Is called after each tick.

    Raises:
        SettingError: A car cannot see in this company.
    """
    actors: list[Recorder | Player] = (
        [Recorder(car.policy) for car in cars] if recorded is None else [Player(one) for one in recorded]
    )
    if rules.is_meeting:
        return _meeting(cars, names, track, rules, seed, actors, on_progress)
    return [_alone(cars[0], track, rules, seed, actors[0], on_progress)]


def _alone(
    car: TrainedCar, track: Track, rules: CarRules, seed: int, actor: Recorder | Player, on_progress: OnProgress
) -> CarDrive:
    trial_rules = rules.trial_rules()
    car = in_race(car, rules)
    world = car.world(track, num_cars=1, start_shares=[0.0], laps=trial_rules.laps_in_one)
    laps_in_all = trial_rules.number_of_trials

    def watch(laps: int, report: Array, ticks: int) -> None:
        progress_percent = float(report["progress"])
        share = (laps + progress_percent / 100.0) / laps_in_all
        if rules.race_seconds is not None:
            share = ticks * TICK_SECONDS / rules.race_seconds
        of = f" of {rules.laps}" if rules.race_seconds is None else ""
        text = f"lap {min(laps + 1, laps_in_all)}{of}, {max(progress_percent, 0.0):.0f} %"
        on_progress(min(max(share, 0.0), 1.0), text, _places_of([report]))

    record = judge_race(actor, world, trial_rules, seed, watch)
    end = record.trials[-1]
    outcome = Outcome(
        laps=tuple(one.seconds for one in record.trials),
        total_seconds=round(len(record.ticks) * TICK_SECONDS, 6),
        progress_percent=round(end.progress_percent, 4),
        resets=sum(one.reset_count for one in record.trials),
        crashes=sum(one.crash_count for one in record.trials),
        off_tracks=sum(one.off_track_count + one.reversed_count for one in record.trials),
        penalty_seconds=round(sum(one.penalty_seconds for one in record.trials), 6),
        ended=end.status,
        digest=digest_of(record.ticks),
        mean_speed_mps=round(float(record.ticks["driven_speed"].mean()), 6),
    )
    return CarDrive(car, outcome, record.ticks, actor.actions, record, world.track)


def in_race(car: TrainedCar, rules: CarRules) -> TrainedCar:
    """Return a car in the race's settings; what it was trained in does not matter."""
    groups = dict.fromkeys(race_groups(rules.type), rules.objects())
    settings = Settings(
        race=rules.race_config(car.settings.race.car),
        camera=car.settings.camera,
        **{name: group for name, group in groups.items() if group is not None},
    )
    return replace(car, settings=settings)


def _meeting(
    cars: Sequence[TrainedCar],
    names: Sequence[str],
    track: Track,
    rules: CarRules,
    seed: int,
    actors: Sequence[Recorder | Player],
    on_progress: OnProgress,
) -> list[CarDrive]:
    drivers = [
        replace(driver_of(car, name), policy=actor) for car, name, actor in zip(cars, names, actors, strict=True)
    ]
    result = race_head_to_head(
        drivers, track, rules.meeting_rules(), rules.race_config(cars[0].settings.race.car), seed,
        lambda share, reports: on_progress(share, f"{100.0 * share:.0f} % of their races", _places_of(reports)),
    )  # fmt: skip
    places = _places(result)
    driven = track.reversed() if rules.reverse else track
    outcomes = [_met(result, index, place) for index, place in enumerate(places)]
    ticks = [result.ticks[0][:, index] for index in range(len(cars))]
    return [
        CarDrive(car, outcome, own, actor.actions, None, driven, result)
        for car, outcome, own, actor in zip(cars, outcomes, ticks, actors, strict=True)
    ]


def _places(result: RaceResult) -> list[int]:
    """Return each driver's place over all races of a heat: by wins, then by the sum of places."""
    showings = [result.of(index) for index in range(len(result.drivers))]
    keys = [(-sum(one.place == 1 for one in own), sum(one.place for one in own)) for own in showings]
    return [1 + sum(other < key for other in keys) for key in keys]


def _places_of(reports: Iterable[Array]) -> Places:
    return tuple((round(float(one["front_x"]), 3), round(float(one["front_y"]), 3)) for one in reports)


def _met(result: RaceResult, index: int, place: int) -> Outcome:
    showings = result.of(index)
    laps, seconds = [], 0.0
    for ticks in result.ticks:
        own = ticks[:, index]
        ends = np.flatnonzero(own["status"] == race.LAP_COMPLETE)
        laps += [round(float(lap), 6) for lap in own["lap_seconds"][ends]]
        parked = np.flatnonzero(own["status"] == race.PARK)
        seconds += (int(parked[0]) if len(parked) else len(own)) * TICK_SECONDS
    finished = [one.seconds for one in showings if one.seconds is not None]
    return Outcome(
        laps=tuple(laps),
        total_seconds=round(sum(finished) if len(finished) == len(showings) else seconds, 6),
        progress_percent=round(100.0 * (showings[-1].laps % 1.0), 4),
        crashes=sum(one.crashes for one in showings),
        off_tracks=sum(one.off_tracks for one in showings),
        resets=sum(one.crashes + one.off_tracks for one in showings),
        place=place,
        places=tuple(one.place for one in showings),
        ended=showings[-1].ended,
        digest=digest({str(number): ticks[:, index]["front_x"] for number, ticks in enumerate(result.ticks)}),
    )


def digest_of(ticks: Array) -> str:
    """Return the SHA-256 of every column of a drive."""
    return digest({name: np.ascontiguousarray(ticks[name]) for name in ticks.dtype.names or ()})
