"""Checks of lessons 11 and 12, a new road and the real car: recorded laps under disturbances, and a pupil's own cars.

What simulates is imported where it is needed: the first page of the course shall not wait for it.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.lessons.checking import Answer, Verdict, compared, material, passed, predicted, tried

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.players.trained_car import TrainedCar
    from racecraft.worlds.deepracer.tracks.track import Track

STARTS, ENOUGH, MOST = 5, 4, 3
"""Starts of an evaluation, and of how many a car has to be better, or to lap."""


def worst_disturbance(answer: Answer) -> Verdict:
    """A prediction: which of four disturbances costs the car most laps?"""
    told = material(__package__, "real.json")
    rows = [[row["disturbance"], row["laps"]] for row in told["rows"]]
    return predicted(answer, "reason", "acts_late", rows, tries=told["tries"])


def facts() -> dict[str, Any]:
    """Return under which disturbances by themselves the car surely laps less, and under how many it lapped less."""
    undisturbed, *rows = material(__package__, "real.json")["rows"]
    rows = [row for row in rows if row["disturbance"] != "all together"]
    sure = [row["disturbance"] for row in rows if row["high"] < undisturbed["low"]]
    fewer = sum(row["laps"] < undisturbed["laps"] for row in rows)
    return {"sure": len(sure), "sure_names": ", ".join(sure), "fewer": fewer, "undisturbed_low": undisturbed["low"]}


def surely_worse(answer: Answer) -> Verdict:
    """Under how many disturbances by themselves the interval of laps lies below the undisturbed one."""
    given, values = round(answer.number("count")), facts()
    return compared(given, values["sure"], 0.0, {"fewer_laps": values["fewer"]}, given=given)


def varied_car(answer: Answer) -> Verdict:
    """A pupil's car that was trained with variation comes further than another under latency, from 4 of 5 starts."""
    plain, varied = (late_drives(run) for run in answer.two_models("plain", "varied").values())
    pairs = list(zip(plain, varied, strict=True))
    won = sum(other > one for one, other in pairs)
    rows = [(number, *two) for number, two in enumerate(pairs, 1)]
    values = {"won": won, "starts": STARTS, "plain": sum(plain) / STARTS, "varied": sum(varied) / STARTS}
    case = "" if won >= ENOUGH else "both_lap" if min(plain) >= 100 else "fewer"
    return Verdict("tried" if case else "passed", case, values, rows)


def late_drives(run: Path) -> list[float]:
    """Return how far a car comes from each of five starts while its commands act late, per cent of a lap."""
    from racecraft.worlds.deepracer.env.variation import only
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car

    car = load_trained_car(run)
    return _from_starts(car, car.trained_on, variation=only("strong", ["latency"]))


def _from_starts(car: TrainedCar, track: Track, **variation: Any) -> list[float]:
    from racecraft.worlds.deepracer.evaluation.laps import judge_starts

    starts = [start / STARTS for start in range(STARTS)]
    laps = judge_starts(car.policy, car.world(track, STARTS, starts, **variation)).laps
    return [lap.progress_percent for lap in laps]


def new_road(answer: Answer) -> Verdict:
    """A pupil's car, trained on three tracks, laps one that it has never seen from 3 of 5 starts."""
    name = answer.choice("track")
    trained, progress = on_track(answer.model("car"), name)
    laps = sum(one >= 100 for one in progress)
    values = {"trained": ", ".join(trained), "laps": laps, "starts": STARTS, "progress": sum(progress) / STARTS}
    if name in trained:
        return tried("trained_here", **values)
    if laps >= MOST:
        return passed(**values)
    return tried("few_tracks" if len(trained) < 3 else "few", **values)


def on_track(run: Path, name: str) -> tuple[list[str], list[float]]:
    """Return the tracks that a car was trained on, and how far it comes on one from five starts, per cent of a lap."""
    from racecraft.worlds.deepracer.players.run_courses import courses_of_run
    from racecraft.worlds.deepracer.players.trained_car import load_trained_car
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    car = load_trained_car(run)
    return [one.track.name for one in courses_of_run(car.run)], _from_starts(car, load_track(name))


def packed_car(answer: Answer) -> Verdict:
    """A prediction: how often does a car's model, packed for the real car, choose as in the simulator?"""
    packed = pack(answer.model("car"))
    shares = packed["small_frames_alike"]
    own = 100.0 if shares is None else 100.0 * shares
    return predicted(answer, "reason", "same_numbers", [(100.0, own)], count=packed["checked_on"])


def pack(run: Path) -> dict[str, Any]:
    """Return what an export for the car tells: how many pictures it was compared on, and how alike both choose."""
    from racecraft.actions.export import ExportRequest, export_run

    with tempfile.TemporaryDirectory() as folder:
        request = ExportRequest(run=str(run), to="car", output=Path(folder) / "model.tar.gz")
        return export_run(request).as_dictionary()
