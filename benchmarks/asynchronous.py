"""PPO with its learner beside its actors, and PPO that waits: `python benchmarks/asynchronous.py FOLDER [--seeds 3]`.

Two questions, three parts of `asynchronous.json` in the folder. *curves*: what is lost by learning from weights one
update old; CartPole-v1, greedy returns by environment steps. *slow*: what is gained where the world is slow; the same
CartPole, whose every tick waits as a scene in another program does, seconds of the clock for equally many steps.
*unity*: the same of a Unity scene in a process of its own, over ML-Agents' protocol; the stand-in of Basic, 64 times
side by side, that takes 16 ms a tick, as an engine does that simulates and draws. Both want a quiet machine, the first
does not.
"""

from __future__ import annotations

import argparse
import json
import stat
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
from gymnasium.envs.classic_control.cartpole import CartPoleEnv

import racecraft
from racecraft.formats.atomic import write_atomic
from racecraft.training.callbacks import IterationReport
from racecraft.training.request import TrainRequest
from racecraft.training.worlds import train
from racecraft.worlds.gymnasium.training.trainer import GymRequest
from racecraft.worlds.unity.training.plan import UnityRequest

PLAIN, SLOW = "CartPole-v1", "SlowCartPole-v1"
GOAL = 475.0
"""CartPole-v1 counts as solved from this mean return on."""
STEPS, SLOW_ITERATIONS, WAIT_SECONDS, WORLDS = 30_000, 30, 0.002, 8
"""Of a curve; of a measurement in the slow world, after one iteration that does not count; each of its worlds waits so
long a tick, one after the other: 16 ms a tick of all."""

NEVER = "evaluation.every=1000"
OFTENER = ("evaluation.every=10", "evaluation.episodes=5")
EPOCHS = 4
"""Passes over each rollout; more move the policy further than a correction by one update can make good."""

SCENES, SCENE_SECONDS, SCENE_ITERATIONS = 64, 0.016, 12
"""Agents of the Unity scene, how long it takes for a tick of all of them, and what is measured, as above."""
SCENE = f"""#!{{python}}
import sys, time
sys.path.insert(0, {{home!r}})
from racecraft.worlds.unity.env import basic_scene
class Slow(basic_scene.BasicScene):
    def act(self, actions):
        time.sleep({SCENE_SECONDS})
        super().act(actions)
basic_scene.BasicScene = Slow
sys.exit(basic_scene.main())
"""


class SlowCartPole(CartPoleEnv):
    """A pole whose every tick is waited for."""

    def step(self, action: Any) -> Any:
        """Wait, then step."""
        time.sleep(WAIT_SECONDS)
        return super().step(action)


class Noting:
    """Notes (steps, mean greedy return) of each evaluation, and when each iteration was over."""

    def __init__(self) -> None:
        self.points: list[tuple[int, float]] = []
        self.over: list[float] = []
        self.phases: list[dict[str, float]] = []

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Nothing is begun."""

    def iteration(self, report: IterationReport) -> None:
        """Note it."""
        self.over.append(time.perf_counter())
        self.phases.append(dict(report.phase_seconds))
        if report.result is not None:
            self.points.append((report.steps, round(report.result.score, 1)))

    def end(self, reason: str) -> None:
        """Nothing is left to do."""


def words(beside: bool) -> tuple[str, ...]:
    """Return the settings of both ways."""
    return (f"ppo.asynchronous={str(beside).lower()}", f"ppo.epochs={EPOCHS}", "runtime.threads=1")


def trained(world: str, beside: bool, seed: int, stop: str, *settings: str) -> Noting:
    """Train once in a Gymnasium world and return what was noted."""
    overrides = (*words(beside), f"rollout.num_worlds={WORLDS}", *settings)
    return noted(GymRequest(world, stops=(stop,), seed=seed, overrides=overrides))


def noted(request: TrainRequest) -> Noting:
    """Train once and return what was noted."""
    noting = Noting()
    with tempfile.TemporaryDirectory() as home:
        train(replace(request, run=Path(home) / "run"), noting, lambda line: None)
    return noting


def curves(seeds: int, steps: int) -> dict[str, Any]:
    """Return the curve of every seed, both ways, and the steps to the goal."""
    told: dict[str, Any] = {}
    for name, beside in (("waits", False), ("beside", True)):
        points = {
            str(seed): trained(PLAIN, beside, seed, f"steps={steps}", *OFTENER).points for seed in range(1, seeds + 1)
        }
        solved = {seed: next((steps for steps, score in one if score >= GOAL), None) for seed, one in points.items()}
        told[name] = {"steps_to_goal": solved, "curves": points}
    return told


def slow(seeds: int) -> dict[str, Any]:
    """Return seconds of an iteration in the slow world, both ways."""
    gymnasium.register(SLOW, lambda **words: SlowCartPole(**words), max_episode_steps=500)
    stop = f"iterations={SLOW_ITERATIONS + 1}"
    return both_ways(seeds, SLOW_ITERATIONS, lambda beside, seed: trained(SLOW, beside, seed, stop, NEVER))


def unity(seeds: int) -> dict[str, Any]:
    """Return the same of a Unity scene in a process of its own."""
    settings = ("rollout.horizon=64", "ppo.batch_size=256", "network.hidden_units=128,128", NEVER)
    with tempfile.TemporaryDirectory() as folder:
        player = Path(folder) / "Slow.x86_64"
        player.write_text(SCENE.format(python=sys.executable, home=str(Path(racecraft.__file__).parent.parent)))
        player.chmod(player.stat().st_mode | stat.S_IXUSR)
        asked = UnityRequest(
            str(player), env_args=("--agents", str(SCENES)), stops=(f"iterations={SCENE_ITERATIONS + 1}",)
        )

        def one(beside: bool, seed: int) -> Noting:
            return noted(replace(asked, seed=seed, overrides=(*words(beside), *settings)))

        return both_ways(seeds, SCENE_ITERATIONS, one)


def both_ways(seeds: int, iterations: int, one: Callable[[bool, int], Noting]) -> dict[str, Any]:
    """Return seconds of an iteration, interleaved: each round's, and their medians."""
    rounds: dict[str, list[float]] = {"waits": [], "beside": []}
    phases: dict[str, Any] = {}
    for seed in range(1, seeds + 1):
        for name, beside in (("waits", False), ("beside", True)):
            noting = one(beside, seed)
            over = noting.over[: iterations + 1]  # the last evaluation tells its iteration again
            rounds[name].append(round((over[-1] - over[0]) / iterations, 4))
            phases[name] = {
                phase: round(statistics.median(one[phase] for one in noting.phases[1:]), 4)
                for phase in ("collect", "learn")
            }
    medians = {name: statistics.median(seconds) for name, seconds in rounds.items()}
    return {"seconds_an_iteration": rounds, "medians": medians, "phases": phases,
            "times_as_fast": round(medians["waits"] / medians["beside"], 3)}  # fmt: skip


def main() -> None:
    """Measure what is asked for and keep it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=STEPS, help="of a curve")
    parser.add_argument("--part", choices=("curves", "slow", "unity"), help="only this; others stay")
    asked = parser.parse_args()
    place = asked.folder / "asynchronous.json"
    told: dict[str, Any] = json.loads(place.read_text()) if place.is_file() else {}
    parts = {"curves": lambda: curves(asked.seeds, asked.steps), "slow": lambda: slow(asked.seeds),
             "unity": lambda: unity(asked.seeds)}  # fmt: skip
    for name, part in parts.items():
        if asked.part in (None, name):
            told[name] = part()
            write_atomic(place, (json.dumps(told, indent=1) + "\n").encode())
    for name, one in told.get("curves", {}).items():
        print(f"{name}: steps to {GOAL:g} by seed {one['steps_to_goal']}")
    for name in ("slow", "unity"):
        if name in told:
            print(name, told[name])


if __name__ == "__main__":
    main()
