"""The figures' models: the design's numbers, and the browser's twin equal to Python on random cases."""

import json
import random
import shutil
import subprocess
from pathlib import Path

import pytest

import racecraft.lessons
from racecraft.lessons.models import family, fork
from racecraft.lessons.models import grid as g
from racecraft.lessons.models import policy_gradient as pg
from racecraft.lessons.models.chance import Chance
from racecraft.worlds.deepracer import lessons as deepracer_lessons
from racecraft.worlds.deepracer.files import reward_samples
from racecraft.worlds.deepracer.files.reward_file import load_reward_function
from racecraft.worlds.deepracer.lessons.sight import patches

MODULES = Path(racecraft.lessons.__file__).parent / "modules"
NODE = shutil.which("node")


def test_the_grid_has_the_numbers_of_its_exercises():
    road = g.make_grid()
    drives = list(g.every_drive(road))
    assert len(drives) == 337
    assert max(one.total for one in drives) == 12.0
    assert sum(abs(one.total - 2.2) < 1e-9 for one in drives) == 6
    assert [round(v, 2) for v in g.optimal_values(road, 0.9)[2]] == [9.37, 8.19, 6.88, 5.42, 3.8, 2.0, 0.0]
    assert [round(v, 2) for v in g.random_values(road, 1.0)[2]] == [3.1, 2.81, 2.45, 2.0, 1.44, 0.73, 0.0]
    reached = sum(3.0 ** -len(one.moves) for one in drives if one.ended == g.GOAL)
    assert reached == pytest.approx(g.chance_to_reach(6))


def grid_cases(count):
    rng = random.Random(7)
    for seed in range(count):
        told = {
            "columns": rng.randint(3, 9),
            "pays": rng.choice(["centre", "goal"]),
            "goal": 2,
            "moves": rng.choice(["ahead", "free"]),
        }
        changed = [[rng.randrange(5), rng.randrange(told["columns"]), round(rng.uniform(-4, 4), 1)] for _ in range(3)]
        yield {
            "told": told, "changed": changed, "gamma": round(rng.uniform(0, 0.95), 2), "seed": seed,
            "moves": [rng.randrange(3) for _ in range(9)],
            "learning": {"alpha": round(rng.uniform(0.1, 1), 2), "epsilon": round(rng.random(), 2), "drives": 5},
        }  # fmt: skip


def in_python(case):
    road = g.make_grid(case["told"]["columns"], case["told"]["pays"], 2.0, case["told"]["moves"])
    for row, column, pay in case["changed"]:
        road = g.with_pay(road, (row, column), pay)
    chance = Chance(case["seed"])
    q, totals = g.learn(road, g.Learning(gamma=case["gamma"], **case["learning"]), chance)
    return {
        "values": g.optimal_values(road, case["gamma"]), "random": g.random_values(road, case["gamma"]),
        "total": g.drive(road, case["moves"]).total, "best": list(g.best_drive(road, case["gamma"]).moves),
        "q": q, "totals": totals, "greedy": list(g.greedy_drive(road, q, chance).moves),
    }  # fmt: skip


GRID_SCRIPT = """
import * as g from "MODULES/grid.js";
import { readFileSync } from "node:fs";
const found = JSON.parse(readFileSync(0, "utf8")).map(one => {
  const road = g.makeGrid(one.told), chance = new g.Chance(one.seed);
  for (const [row, column, pay] of one.changed) road.pay[row][column] = pay;
  const { q, totals } = g.learn(road, { gamma: one.gamma, ...one.learning }, chance);
  return { values: g.optimalValues(road, one.gamma), random: g.randomValues(road, one.gamma),
    total: g.drive(road, one.moves).total,
    best: g.bestDrive(road, one.gamma).moves, q, totals, greedy: g.greedyDrive(road, q, chance).moves };
});
console.log(JSON.stringify(found));
"""


def in_node(script, cases):
    code = script.replace("MODULES", MODULES.as_uri())
    done = subprocess.run(
        [NODE, "--input-type=module", "-e", code], input=json.dumps(cases), capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout)


def same(ours, theirs):
    if isinstance(ours, dict):
        return ours.keys() == theirs.keys() and all(same(ours[key], theirs[key]) for key in ours)
    if isinstance(ours, list | tuple):
        return len(ours) == len(theirs) and all(map(same, ours, theirs))
    return ours == pytest.approx(theirs, abs=1e-9)


@pytest.mark.skipif(NODE is None, reason="no node here to run the browser's modules")
def test_the_browser_computes_the_grid_as_python_does():
    cases = list(grid_cases(200))
    for case, theirs in zip(cases, in_node(GRID_SCRIPT, cases), strict=True):
        ours = in_python(case)
        assert same(ours, theirs), case
    cases[0]["gamma"] = 0.95 - cases[0]["gamma"]
    assert not same(in_python(cases[0]), in_node(GRID_SCRIPT, [dict(cases[0], gamma=0.5)])[0]), "the test can fail"


STEP_SCRIPT = """
import * as g from "MODULES/gradient.js";
import { worth } from "MODULES/fork.js";
import { readFileSync } from "node:fs";
console.log(JSON.stringify(JSON.parse(readFileSync(0, "utf8")).map(one => {
  const slope = g.gradient(one.theta, one.batch, one.baseline), after = g.climbed(one.theta, slope, one.step);
  return { slope, pi: g.probabilities(after), entropy: g.entropy(g.probabilities(after)),
    worth: worth(one.gamma, one.steps, one.prize, one.cost) };
})));
"""


def step_cases(count):
    rng = random.Random(8)
    for _ in range(count):
        yield {
            "theta": [rng.uniform(-3, 3) for _ in range(3)], "step": rng.uniform(0.1, 5),
            "baseline": rng.random() < 0.5,
            "batch": [[rng.randrange(3), rng.uniform(-5, 12)] for _ in range(rng.randint(1, 9))],
            "gamma": rng.random(), "steps": rng.randint(1, 20), "prize": rng.uniform(0, 2), "cost": rng.uniform(0, 0.4),
        }  # fmt: skip


@pytest.mark.skipif(NODE is None, reason="no node here to run the browser's modules")
def test_the_browser_computes_a_step_as_python_does():
    cases = list(step_cases(1000))
    for case, theirs in zip(cases, in_node(STEP_SCRIPT, cases), strict=True):
        slope = pg.gradient(case["theta"], case["batch"], case["baseline"])
        pi = pg.probabilities(pg.climbed(case["theta"], slope, case["step"]))
        worth = fork.worth(case["gamma"], case["steps"], case["prize"], case["cost"])
        assert same({"slope": slope, "pi": pi, "entropy": pg.entropy(pi), "worth": worth}, theirs)


def test_a_step_by_hand_has_the_numbers_of_the_sheet():
    batch = [(1, 2.2), (0, 0.1), (2, 0.1), (1, 4.1)]
    for baseline, slope, after in ((False, 1.0333, 0.5205), (True, 0.7625, 0.4697)):
        found = pg.gradient((0, 0, 0), batch, baseline)
        assert found[1] == pytest.approx(slope, abs=1e-4)
        assert pg.probabilities(pg.climbed((0, 0, 0), found, 0.5))[1] == pytest.approx(after, abs=1e-4)
    assert fork.turn() == pytest.approx(0.579, abs=5e-4)
    assert fork.dearest(1.0) == pytest.approx((1.0 - 0.1) / (7 - 3)), "the prizes differ by 0.9, the ways by 4 steps"


def test_the_family_has_the_numbers_of_its_lesson():
    for temperature, share in ((0.2, 0.9999), (1, 0.77), (5, 0.42)):
        assert family.at_temperature((12, 10.1, 10.1), temperature)[0] == pytest.approx(share, abs=5e-3)
    scores = family.search_scores((0.5, 0.4, 0.1), (0.5, 0.3, 0.2), (6, 3, 1), 1.5)
    assert scores == pytest.approx([0.839, 0.756, 0.574], abs=5e-4)
    assert [round(100 * one) for one in family.priorities((2, 1, 0.5, 0.1), 0.6)] == [44, 29, 19, 7]
    assert family.slope_by_trying(lambda theta: -((theta - 3) ** 2), 0, 0.5) == pytest.approx(6)


FAMILY_SCRIPT = """
import { atTemperature, searchScores } from "MODULES/family.js";
import { readFileSync } from "node:fs";
console.log(JSON.stringify(JSON.parse(readFileSync(0, "utf8")).map(({ values, priors, visits, c }) =>
  [...atTemperature(values, c), ...searchScores(values, priors, visits, c)])));
"""


@pytest.mark.skipif(NODE is None, reason="no node here to run the browser's modules")
def test_the_browser_computes_the_family_as_python_does():
    rng = random.Random(10)
    cases = [
        {"values": [rng.uniform(-5, 12) for _ in range(3)], "priors": [rng.random() for _ in range(3)],
         "visits": [rng.randint(1, 40) for _ in range(3)], "c": rng.uniform(0.1, 5)}
        for _ in range(1000)
    ]  # fmt: skip
    for case, theirs in zip(cases, in_node(FAMILY_SCRIPT, cases), strict=True):
        ours = family.at_temperature(case["values"], case["c"]) + family.search_scores(**case)
        assert ours == pytest.approx(theirs)


SAMPLES_SCRIPT = """
import { samples } from "CARS/samples.js";
import { readFileSync } from "node:fs";
console.log(JSON.stringify(JSON.parse(readFileSync(0, "utf8")).map(samples)));
"""


@pytest.mark.skipif(NODE is None, reason="no node here to run the browser's modules")
def test_the_browser_pays_as_the_sample_rewards_do():
    rng, cars = random.Random(9), Path(deepracer_lessons.__file__).parent / "modules"
    cases = [{"distance": rng.uniform(0, 0.6), "width": rng.uniform(0.6, 1.2), "onTrack": rng.random() < 0.8}
             for _ in range(1000)]  # fmt: skip
    rewards = [
        load_reward_function(Path(reward_samples.__file__).parent / f"{name}.py")
        for name in ("inside_borders", "centre_line", "constant")
    ]
    for case, theirs in zip(cases, in_node(SAMPLES_SCRIPT.replace("CARS", cars.as_uri()), cases), strict=True):
        told = {"distance_from_center": case["distance"], "track_width": case["width"],
                "all_wheels_on_track": case["onTrack"]}  # fmt: skip
        assert [reward.call(told) for reward in rewards] == pytest.approx(theirs), case


PLACES_SCRIPT = """
import { placeOf } from "CARS/sight.js";
import { readFileSync } from "node:fs";
console.log(JSON.stringify(JSON.parse(readFileSync(0, "utf8")).map(one => placeOf(...one))));
"""


@pytest.mark.skipif(NODE is None, reason="no node here to run the browser's modules")
def test_the_browser_finds_every_patch_where_python_put_it():
    cars = Path(deepracer_lessons.__file__).parent / "modules"
    cases = [[rows, columns, one] for rows, columns in ((1, 1), (3, 2), (6, 8)) for one in patches(rows, columns)]
    places = [place for rows, columns in ((1, 1), (3, 2), (6, 8)) for place in range(len(patches(rows, columns)))]
    assert in_node(PLACES_SCRIPT.replace("CARS", cars.as_uri()), cases) == places
