"""The figures about Unity compute in the browser as the program does; a random agent earns what can be worked out."""

import json
import random
import shutil
import subprocess
from itertools import pairwise
from pathlib import Path

import pytest
import torch
from torch import nn

from racecraft.algorithms.ppo import LINEAR, PpoConfig, _scheduled
from racecraft.worlds.unity import lessons
from racecraft.worlds.unity.lessons import basic, network

NODE = shutil.which("node")
MODULES = Path(lessons.__file__).parent / "modules"
SCRIPT = """
import { NAME } from "MODULES/FILE";
import { readFileSync } from "node:fs";
console.log(JSON.stringify(JSON.parse(readFileSync(0, "utf8")).map(one => NAME(...one))));
"""


def in_node(file, name, cases):
    """Return what a function of a module gives for the arguments of each case."""
    code = SCRIPT.replace("MODULES", MODULES.as_uri()).replace("FILE", file).replace("NAME", name)
    done = subprocess.run(
        [NODE, "--input-type=module", "-e", code], input=json.dumps(cases), capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout)


@pytest.mark.skipif(NODE is None, reason="no node here to run the browser's modules")
def test_the_browser_plays_basic_as_the_stand_in_does():
    rng = random.Random(5)
    games = [rng.choices(basic.ACTIONS, k=rng.randint(1, 60)) for _ in range(1000)]
    ends = set()
    for actions, theirs in zip(games, in_node("basic.js", "play", [[one] for one in games]), strict=True):
        ours = basic.play(actions)
        assert (ours.place, ours.steps, ours.ended) == (theirs["place"], theirs["steps"], theirs["ended"])
        assert ours.total == pytest.approx(theirs["total"])
        ends.add(ours.place if ours.ended else None)
    assert ends == {None, 7, 17}


@pytest.mark.skipif(NODE is None, reason="no node here to run the browser's modules")
def test_the_browser_lets_numbers_fall_as_ppo_does():
    rng = random.Random(6)
    names = {"learning_rate": "learning_rate", "beta": "entropy_weight", "epsilon": "clip"}
    cases = [[rng.choice(list(names)), rng.uniform(0, 1.5), 10 ** rng.uniform(-6, 0)] for _ in range(1000)]
    for (name, done, start), theirs in zip(cases, in_node("schedule.js", "scheduled", cases), strict=True):
        config = PpoConfig(**{names[name]: start})
        assert _scheduled(config, names[name], LINEAR, done) == pytest.approx(theirs), (name, done, start)


@pytest.mark.skipif(NODE is None, reason="no node here to run the browser's modules")
def test_the_browser_and_the_recipe_compute_a_network_as_pytorch_does():
    rng, cases, scores = random.Random(7), [], []
    for _ in range(1000):
        sizes = [rng.randint(1, 9) for _ in range(rng.randint(2, 4))]
        layers = [nn.Linear(*pair).double() for pair in pairwise(sizes)]
        made = [{"weights": one.weight.tolist(), "bias": one.bias.tolist()} for one in layers]
        observation = [rng.uniform(-2, 2) for _ in range(sizes[0])]
        steps = [step for layer in layers for step in (layer, nn.Tanh())][:-1]
        cases.append([observation, made])
        scores.append(nn.Sequential(*steps)(torch.tensor(observation, dtype=torch.float64)).tolist())
    for case, right, after in zip(cases, scores, in_node("network.js", "forward", cases), strict=True):
        assert network.scores(*case) == pytest.approx(right)
        assert after[-1] == pytest.approx(right)


def test_a_random_agent_earns_what_can_be_worked_out():
    """Three places to the left, seven to the right: 7 of 10 end left, after 3 * 7 moves; every third step stays."""
    (_, left, _, of_left), (_, right, _, _), (_, count, steps, total) = basic.random_episodes()
    assert count == left + right == basic.EPISODES
    assert left / count == pytest.approx(0.7, abs=0.05)
    assert steps == pytest.approx(1.5 * 3 * 7, abs=3)
    assert of_left < 0.1
    assert total == pytest.approx(0.7 * 0.1 + 0.3 * 1.0 - 0.01 * 31.5, abs=0.05)
