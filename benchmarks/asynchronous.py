"""PPO with its learner beside its actors, and PPO that waits: `python benchmarks/asynchronous.py FOLDER [--seeds 3]`.

Two questions, two parts of `asynchronous.json` in the folder. *curves*: what is lost by learning from weights one
update old; CartPole-v1, greedy returns by environment steps. *slow*: what is gained where the world is slow; the same
CartPole, whose every tick waits as a scene in another program does, seconds of the clock for equally many steps. The
second wants a quiet machine, the first does not.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import gymnasium
from gymnasium.envs.classic_control.cartpole import CartPoleEnv

from racecraft.formats.whole import write_whole
from racecraft.training.callbacks import IterationReport
from racecraft.training.gymnasium.trainer import GymRequest
from racecraft.training.worlds import train

PLAIN, SLOW = "CartPole-v1", "SlowCartPole-v1"
GOAL = 475.0
"""CartPole-v1 counts as solved from this mean return on."""
STEPS, SLOW_ITERATIONS, WAIT_SECONDS, WORLDS = 40_000, 30, 0.002, 8
"""Of a curve; of a measurement in the slow world, after one iteration that does not count; each of its worlds waits so
long a tick, one after the other: 16 ms a tick of all."""

OFTENER = ("evaluation.every=5", "evaluation.episodes=10")


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


def trained(world: str, beside: bool, seed: int, stop: str, *settings: str) -> Noting:
    """Train once and return what was noted."""
    noting, every = Noting(), (f"ppo.asynchronous={str(beside).lower()}", f"rollout.num_worlds={WORLDS}")
    with tempfile.TemporaryDirectory() as home:
        request = GymRequest(
            world, stops=(stop,), run=Path(home) / "run", seed=seed, overrides=(*every, "runtime.threads=1", *settings)
        )
        train(request, noting, lambda line: None)
    return noting


def curves(seeds: int) -> dict[str, Any]:
    """Return the curve of every seed, both ways, and the steps to the goal."""
    told: dict[str, Any] = {}
    for name, beside in (("waits", False), ("beside", True)):
        points = {
            str(seed): trained(PLAIN, beside, seed, f"steps={STEPS}", *OFTENER).points for seed in range(1, seeds + 1)
        }
        solved = {seed: next((steps for steps, score in one if score >= GOAL), None) for seed, one in points.items()}
        told[name] = {"steps_to_goal": solved, "curves": points}
    return told


def slow(seeds: int) -> dict[str, Any]:
    """Return seconds of an iteration in the slow world, both ways, interleaved: each round's, and their medians."""
    gymnasium.register(SLOW, lambda **words: SlowCartPole(**words), max_episode_steps=500)
    rounds: dict[str, list[float]] = {"waits": [], "beside": []}
    phases: dict[str, Any] = {}
    for seed in range(1, seeds + 1):
        for name, beside in (("waits", False), ("beside", True)):
            noting = trained(SLOW, beside, seed, f"iterations={SLOW_ITERATIONS + 1}", "evaluation.every=1000")
            over = noting.over[: SLOW_ITERATIONS + 1]  # the last evaluation tells its iteration again
            rounds[name].append(round((over[-1] - over[0]) / SLOW_ITERATIONS, 4))
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
    parser.add_argument("--part", choices=("curves", "slow"), help="only this one; the other stays as it was")
    asked = parser.parse_args()
    place = asked.folder / "asynchronous.json"
    told: dict[str, Any] = json.loads(place.read_text()) if place.is_file() else {}
    for name, part in (("curves", curves), ("slow", slow)):
        if asked.part in (None, name):
            told[name] = part(asked.seeds)
            write_whole(place, (json.dumps(told, indent=1) + "\n").encode())
    for name, one in told.get("curves", {}).items():
        print(f"{name}: steps to {GOAL:g} by seed {one['steps_to_goal']}")
    if "slow" in told:
        print(told["slow"])


if __name__ == "__main__":
    main()
