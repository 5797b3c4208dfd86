"""Checks of lessons 7 and 13 with a pupil's own cars: they run a reward function, and drive and race cars.

What simulates is imported where it is needed: the first page of the course shall not wait for it.
"""

from __future__ import annotations

import random
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.lessons.checking import Answer, AnswerError, Verdict, passed, predicted, tried
from racecraft.lessons.functions import call_for_numbers
from racecraft.worlds.deepracer.lessons.checks import pose

RANGES: Mapping[str, tuple[float, float]] = {
    "distance_from_center": (0.0, 0.35),
    "speed": (0.5, 4.0),
    "steering_angle": (0.0, 30.0),
    "progress": (1.0, 99.0),
}
"""In which a claim's parameter is moved; an angle on both sides."""
EXPECTED = {"faster": ("speed", 1), "nearer": ("distance", -1), "calmer": ("steering", -1)}
"""What of `Driven` a word is about, and the sign of the change that it expects."""
PLACES = 200
LAPS = 3
NEAR = 0.02
"""Share of a lap time below which two cars count as equally fast."""


def claim(answer: Answer) -> Verdict:
    """An idea as a claim: in 200 moments the parameter alone is moved, and the pay has to move as was said."""
    name, pays_more = answer.choice("parameter"), answer.choice("way") == "more"
    rng = random.Random()
    pairs = [_moved(rng, name) for _ in range(PLACES)]
    paid = call_for_numbers(answer.code("code"), "reward_function", [[one] for pair in pairs for one in pair])
    if paid is None:
        return tried("no_number")
    grows = [high - low if pays_more else low - high for low, high in zip(paid[::2], paid[1::2], strict=True)]
    held = sum(one > 0 for one in grows)
    if held == PLACES:
        return passed(count=PLACES)
    if all(one == 0 for one in grows):
        return tried("no_effect", count=PLACES)
    return tried("turned_round" if all(one < 0 for one in grows) else "sometimes", held=held, count=PLACES)


def _moved(rng: random.Random, name: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return a moment with less and one with more of a parameter; all else is the same."""
    low, high = RANGES[name]
    less = rng.uniform(low, high - 0.1 * (high - low))
    more = rng.uniform(less + 0.05 * (high - low), high)
    side = rng.choice((-1, 1)) if name == "steering_angle" else 1
    moment = pose(rng.uniform(0, 0.3), 0.76, rng.random() < 0.5)
    moment |= {other: rng.uniform(*RANGES[other]) for other in ("speed", "steering_angle", "progress")}
    return moment | {name: side * less}, moment | {name: side * more}


def sound_reward(answer: Answer) -> Verdict:
    """What `racecraft reward check --for race` says of the pupil's reward function."""
    from racecraft.worlds.deepracer.driving.reward.check import check_reward
    from racecraft.worlds.deepracer.driving.reward.findings import FAULT
    from racecraft.worlds.deepracer.files.reward_source import read_reward_source

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "reward_function.py"
        path.write_text(answer.code("code"), encoding="utf-8")
        found = check_reward(read_reward_source(path), for_race=True)
    faults = [one for one in found.findings if one.level == FAULT]
    if faults:
        return tried("fault", found=f"{faults[0].text} {faults[0].hint}".strip(), count=len(faults))
    return passed(notes=len(found.findings))


@dataclass(frozen=True)
class Raced:
    """What a car did in three laps that were judged."""

    laps: Sequence[float]
    """Seconds of each that it finished."""
    resets: int

    @property
    def best(self) -> float | None:
        """Its fastest, s; None: it finished none."""
        return min(self.laps, default=None)

    def is_better(self, other: Raced) -> bool:
        """Tell whether it finished more laps, or as many with a clearly faster best one."""
        if len(self.laps) != len(other.laps):
            return len(self.laps) > len(other.laps)
        return self.best is not None and other.best is not None and self.best < (1 - NEAR) * other.best


def raced(cars: Mapping[str, Path]) -> dict[str, Raced]:
    """Return what cars do over three laps on the first one's track, each judged by the league on a seed nobody saw.

    Args:
        cars: Run folders by name.

    Raises:
        UserInputError: One cannot be raced; says why.
    """
    from racecraft.actions.league.entries import EnterRequest, enter_race
    from racecraft.actions.league.judging import JudgeRequest, judge_race
    from racecraft.formats.run_folder import RunFolder
    from racecraft.worlds.deepracer.actions.create_race import CreateRaceRequest, DrivingOptions, create_race
    from racecraft.worlds.deepracer.players.run_track import track_of_run

    track = track_of_run(RunFolder(next(iter(cars.values())))).name
    with tempfile.TemporaryDirectory() as folder:
        league = Path(folder) / "league"
        race = create_race(CreateRaceRequest(
            league=league, title="Lesson", track=(track,), driving=DrivingOptions(laps=LAPS),
        )).race  # fmt: skip
        names = {
            enter_race(EnterRequest(league=league, race=race.id, model=str(run), racer=name)).entry.number: name
            for name, run in cars.items()
        }
        results = judge_race(JudgeRequest(league=league, race=race.id)).results
    if failed := [one.failure for one in results if one.failure]:
        raise AnswerError("A car could not be driven: {failure}", failure=failed[0])
    return {names[one.entries[0]]: _raced(one.drives[0].outcomes[0]) for one in results}


def _raced(outcome: Any) -> Raced:
    return Raced([lap for lap in outcome.laps if lap is not None], outcome.resets)


def _rows(cars: Mapping[str, Raced]) -> list[tuple[Any, ...]]:
    return [(name, len(one.laps), one.best if one.best is not None else "–", one.resets) for name, one in cars.items()]


def own_lap(answer: Answer) -> Verdict:
    """A pupil's car finishes a lap that is judged."""
    (one,) = raced({"own": answer.model("car")}).values()
    if one.best is None:
        return tried("no_lap", resets=one.resets)
    return passed(best=one.best, laps=len(one.laps), resets=one.resets)


def one_change(answer: Answer) -> Verdict:
    """A prediction: is the change kept? The evidence is three judged laps of the car before and after it."""
    rows = raced(answer.two_models("before", "after"))
    before, after = rows["before"], rows["after"]
    right = "keep" if after.is_better(before) else "undo" if before.is_better(after) else "open"
    return predicted(answer, "reason", right, _rows(rows))


@dataclass(frozen=True)
class Driven:
    """What a car did over one lap as it drives by itself."""

    speed: float
    """Mean, m/s."""
    distance: float
    """Mean from the centre line, m."""
    steering: float
    """Mean change of the commanded wheel angle from step to step, degrees."""


def driven(run: Path) -> Driven:
    """Return how a car drives its own track, from the start line as far as it comes."""
    import numpy as np

    from racecraft.worlds.deepracer.analysis.drive import Drive
    from racecraft.worlds.deepracer.evaluation.drive import DriveKeeper
    from racecraft.worlds.deepracer.evaluation.laps import judge_laps
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car

    car, keeper = load_trained_car(run), DriveKeeper()
    judge_laps(car.policy, car.world(car.trained_on, num_cars=1, start_shares=[0.0]), 1, [keeper])
    drive = Drive.from_reports(keeper.drive)
    aside = car.trained_on.locate(np.column_stack([drive.x_m, drive.y_m])).distance
    turned = np.abs(np.diff(np.degrees(drive.steering_rad)))
    return Driven(float(drive.driven_mps.mean()), float(np.abs(aside).mean()), float(turned.mean()))


def as_expected(answer: Answer) -> Verdict:
    """A prediction: does a pupil's own reward change the driving as it was meant to? Two of the pupil's cars drive."""
    name = answer.choice("expected")
    cars = {which: driven(run) for which, run in answer.two_models("before", "own").items()}
    values = {which: getattr(one, EXPECTED[name][0]) for which, one in cars.items()}
    change = EXPECTED[name][1] * (values["own"] - values["before"]) / max(abs(values["before"]), 1e-9)
    right = "same" if abs(change) < NEAR else "as_expected" if change > 0 else "otherwise"
    rows = [(which, one.speed, one.distance, one.steering) for which, one in cars.items()]
    return predicted(answer, "reason", right, rows, **values, change=100 * change)


def beats_first(answer: Answer) -> Verdict:
    """A judged race: the pupil's newer car against the first one."""
    rows = raced(answer.two_models("first", "own"))
    first, own = rows["first"], rows["own"]
    said = {"own": own.best or "–", "first": first.best or "–", "laps": len(own.laps), "first_laps": len(first.laps)}
    if own.is_better(first):
        return passed(**said)
    if first.is_better(own):
        return tried("slower" if own.best is not None else "no_lap", **said)
    return tried("as_fast", **said)
