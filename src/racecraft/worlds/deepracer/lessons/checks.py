"""Checks of the lessons about cars: they read recorded trainings, and run a pupil's code."""

from __future__ import annotations

import cmath
import math
import random
from collections.abc import Mapping, Sequence
from functools import cache
from itertools import combinations, pairwise
from typing import Any

from racecraft.lessons.checking import Answer, Verdict, compared, material, passed, predicted, tried
from racecraft.lessons.functions import call_for_numbers, call_function

LAP_M, HERTZ = 17.71, 15
"""Of re:Invent 2018, and decisions a second."""
SLOW_MPS, FAST_MPS = 0.5, 4.0
NEAR_M, NEAR_DEGREES = 0.1, 10
"""How near the centre line, and north, a place has to be."""
SAME_SHAPE_M = 0.15
SECOND_SAMPLE = """
def reward_function(params):
    reward = 0.1
    if params["distance_from_center"] <= 0.25 * params["track_width"]:
        reward = 1.0
    if params["is_offtrack"]:
        reward = -1.0
    else:
        reward = params["progress"]
    if abs(params["steering_angle"]) > 15:
        reward *= 0.8
    if params["speed"] < 2.5:
        reward *= 0.8
    return float(reward)
"""
MOMENT = {"distance_from_center": 0.0, "track_width": 0.76, "is_offtrack": False, "progress": 50.0,
          "steering_angle": 20.0, "speed": 2.0}  # fmt: skip


@cache
def facts() -> Mapping[str, Any]:
    """Return what the recordings of lessons 1 and 11 came to, and a place where the road of lesson 1 leads north."""
    drives = material(__package__, "learning.json")["drives"]
    north = next(one for one in material(__package__, "drive.json")["centre"]
                 if abs(_of_road(*one)[1] - 90) <= NEAR_DEGREES)  # fmt: skip
    shapes = material(__package__, "shapes.json")["tracks"]
    alike = (two for two in combinations(shapes, 2) if abs(two[0]["length"] - two[1]["length"]) < 1)
    same = min(alike, key=lambda two: shape_distance(two[0]["points"], two[1]["points"]))
    laps = [one["iteration"] for one in drives if one["progress"] >= 100]
    cars = material(__package__, "tracks.json")
    lapped = [track for track, whole in zip(cars["columns"], cars["rows"][-1]["full_laps"], strict=True)
              if whole == cars["starts"]]  # fmt: skip
    return {
        "first_lap": laps[0], "whole_laps": len(laps), "left_road": sum(one["status"] == "off_track" for one in drives),
        "under_half": next(at for at, one in enumerate(drives) if one["progress"] >= 50),
        "later_without": len(drives) - laps[0] + 1 - len(laps), "drives": len(drives), "north_x": north[0],
        "north_y": north[1], "same_road": " and ".join(one["letter"].upper() for one in same),
        "three_lapped": len(lapped), "three_new": len(set(lapped) - set(cars["rows"][-1]["on"])),
    }  # fmt: skip


def first_lap(answer: Answer) -> Verdict:
    """The first iteration whose recorded drive is a whole lap."""
    drives, right = material(__package__, "learning.json")["drives"], facts()["first_lap"]
    given = round(answer.number("iteration"))
    drive = next((one for one in drives if one["iteration"] == given), drives[-1])
    if given != right:
        return tried("before" if given < right else "behind", iteration=given, progress=drive["progress"])
    return passed(iteration=right, count=len(drives))


def drives_off(answer: Answer) -> Verdict:
    """In how many of the recorded drives the car left the road."""
    values, given = facts(), answer.number("count")
    laps = {"laps": values["whole_laps"]}
    return compared(given, values["left_road"], 0.5, laps, count=round(given), all=values["drives"])


def slow_lap(answer: Answer) -> Verdict:
    """What a lap earns where every step pays 1.0, at two speeds."""
    slow, fast = (HERTZ * LAP_M / speed for speed in (SLOW_MPS, FAST_MPS))
    given = answer.number("slow"), answer.number("fast")
    if abs(given[0] - slow) <= 3 and abs(given[1] - fast) <= 3:
        return passed(slow=round(slow), fast=round(fast))
    if abs(given[0] - fast) <= 3 and abs(given[1] - slow) <= 3:
        return tried("exchanged")
    if abs(given[0] - given[1]) <= 3:
        return tried("same")
    if abs(given[0] - LAP_M / SLOW_MPS) <= 1:
        return tried("seconds")
    return tried("other")


@cache
def second_pay() -> float:
    """Return what the second reward function pays at its moment; it is run."""
    (paid,) = call_function(SECOND_SAMPLE, "reward_function", [[MOMENT]])
    return float(paid)


def second_sample(answer: Answer) -> Verdict:
    """What the second reward function pays at one moment."""
    given = answer.number("reward")
    return compared(
        given, second_pay(), 0.05, {"kept_the_one": 0.64, "one_factor": 40.0, "no_factor": 50.0}, reward=given
    )


def nearer_is_more(answer: Answer) -> Verdict:
    """The pupil's reward function pays more nearer the centre: 250 pairs of poses, left and right, on many widths."""
    rng, pairs = random.Random(), []
    for _ in range(250):
        width = rng.uniform(0.6, 1.2)
        near, far = sorted(rng.uniform(0, 0.5 * width) for _ in range(2))
        if far - near < 0.02 * width:
            far = near + 0.1 * width
        is_left = rng.random() < 0.5
        pairs.append((pose(near, width, is_left), pose(far, width, not is_left)))
    found = call_for_numbers(answer.code("code"), "reward_function", [[one] for pair in pairs for one in pair])
    if found is None:
        return tried("no_number")
    for (inner, outer), *paid in zip(pairs, found[::2], found[1::2], strict=True):
        if paid[0] <= paid[1]:
            case = "same" if paid[0] == paid[1] else "turned_round"
            numbers = {"near": inner["distance_from_center"], "far": outer["distance_from_center"]}
            return tried(case, **numbers, width=inner["track_width"], first=float(paid[0]), second=float(paid[1]))
    return passed(count=len(pairs))


def pose(distance: float, width: float, is_left: bool) -> dict[str, Any]:
    """Return what a reward function is told of a car on the road."""
    return {
        "all_wheels_on_track": True, "distance_from_center": round(distance, 4), "track_width": round(width, 4),
        "is_left_of_center": is_left, "is_offtrack": False, "is_crashed": False, "is_reversed": False,
        "progress": 30.0, "steps": 40.0, "speed": 2.0, "steering_angle": 0.0, "heading": 0.0, "x": 1.0, "y": 1.0,
        "closest_waypoints": [0, 1], "waypoints": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], "track_length": LAP_M,
    }  # fmt: skip


def match_curves(answer: Answer) -> Verdict:
    """Which learning rate made which of three curves of a seed that the figure did not show."""
    given = [answer.choice(curve) for curve in "abc"]
    right = ["3e-3", "3e-5", "3e-4"]
    if given == right:
        return passed()
    if given[1] != "3e-5":
        return tried("flat")
    return tried("exchanged" if set(given) == set(right) else "twice")


def clipped(answer: Answer) -> Verdict:
    """The pupil's `clipped(ratio, advantage, limit)` against PPO's objective on 1,000 random pairs."""
    rng = random.Random()
    calls = [[rng.uniform(0.2, 2.5), rng.uniform(-3, 3), 0.2] for _ in range(1000)]
    found = call_function(answer.code("code"), "clipped", calls)
    for (ratio, advantage, limit), given in zip(calls, found, strict=True):
        held = min(max(ratio, 1 - limit), 1 + limit)
        right = min(ratio * advantage, held * advantage)
        if not isinstance(given, int | float) or abs(given - right) > 1e-9:
            case = {ratio * advantage: "never_clipped", held * advantage: "always_clipped"}.get(given, "other")
            return tried(case, ratio=ratio, advantage=advantage, given=str(given)[:30], right=right)
    return passed()


def worst_track(answer: Answer) -> Verdict:
    """A prediction: where the car trained on re:Invent 2018 alone gets least far."""
    tracks = material(__package__, "tracks.json")
    rows = [[row["trained"], *row["progress"]] for row in tracks["rows"]]
    return predicted(answer, "reason", "road_alone", rows, columns=" | ".join(tracks["columns"]))


def heads_north(answer: Answer) -> Verdict:
    """A place on the centre line where the road leads north: `distance_from_center` 0 and `heading` 90."""
    distance, heading = _of_road(answer.number("x"), answer.number("y"))
    values = {"distance": distance, "heading": heading}
    if distance > NEAR_M:
        return tried("off_centre", **values)
    if abs(heading - 90) <= NEAR_DEGREES:
        return passed(**values)
    return tried("opposite" if -135 < heading < -45 else "other_heading", **values)


def _of_road(x: float, y: float) -> tuple[float, float]:
    """Return distance from the recorded drive's centre line, m, and the line's heading there, -180 to 180 degrees."""
    centre, found = material(__package__, "drive.json")["centre"], (math.inf, 0.0)
    for (at_x, at_y), (to_x, to_y) in pairwise(centre):
        along = complex(to_x - at_x, to_y - at_y)
        if along:
            from_start = complex(x - at_x, y - at_y) / along
            share = min(1.0, max(0.0, from_start.real))
            found = min(found, (abs(from_start - share) * abs(along), math.degrees(cmath.phase(along))))
    return found


def same_road(answer: Answer) -> Verdict:
    """Which two of eight outlines are one road: turned, shifted and driven the other way, their points lie nearest."""
    tracks = {one["letter"]: one for one in material(__package__, "shapes.json")["tracks"]}
    one, other = (tracks[answer.choice(name)] for name in ("one", "other"))
    if one is other:
        return tried("twice")
    apart = shape_distance(one["points"], other["points"])
    if apart < SAME_SHAPE_M:
        return passed(apart=apart, names=f"{one['name']}, {other['name']}")
    return tried("lengths" if abs(one["length"] - other["length"]) > 1 else "shapes", apart=apart)


def shape_distance(one: Sequence[Sequence[float]], other: Sequence[Sequence[float]]) -> float:
    """Return how far two closed lines of equally many points, cm, lie apart on average, m, where they fit best."""
    a, b = (_centred(points) for points in (one, other))
    best = math.inf
    for way in (b, b[::-1]):
        for at in range(len(way)):
            moved = way[at:] + way[:at]
            turn = sum(p * q.conjugate() for p, q in zip(a, moved, strict=True))
            turn /= abs(turn) or 1.0
            best = min(best, sum(abs(p - turn * q) for p, q in zip(a, moved, strict=True)) / len(a) / 100)
    return best


def _centred(points: Sequence[Sequence[float]]) -> list[complex]:
    middle = sum(complex(*one) for one in points) / len(points)
    return [complex(*one) - middle for one in points]
