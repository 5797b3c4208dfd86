"""Where a training step's time goes, in one thread: `car_learning.py [--preset aws] [--against OTHER_CHECKOUT/src]`.

Collecting, learning and judging of the default car are timed apart, in microseconds of the processor (other work on the
machine bends them less than the clock) for each step that was trained on; judging counts in once an iteration, as it
does in a training. Each round is a process of its own, this version's and the other's in turns. Medians over the rounds
of the iterations after the first. With `--threads 2` it is the clock that counts, on a machine that does nothing else.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
PHASES = ("collect", "learn", "judge")


def measured(preset: str, iterations: int, threads: int) -> dict[str, float]:
    """Train in this process; return microseconds a step, phase by phase: the processor's with one thread."""
    import numpy as np

    from racecraft.algorithms.ppo import PpoLearner
    from racecraft.players.trained import GreedyPolicy
    from racecraft.rollout.collector import Collector
    from racecraft.training.processor import prepare_processor
    from racecraft.worlds.deepracer.training import trainer as car
    from racecraft.worlds.deepracer.training.evaluator import CarEvaluator

    planned = car.plan_car(car.RaceRequest(preset=preset))
    prepare_processor(threads)
    now = time.process_time if threads == 1 else time.perf_counter
    reward = car.load_reward(None)
    world, judged = car.driven_world(planned, reward), car.judged_world(planned, reward)
    car.warm_up((world, judged), print)
    learner = PpoLearner.build(world.spec, planned.settings, 1)
    rollout = planned.settings.rollout
    collector = Collector(world, learner, rollout.horizon, 1)
    flying = [car.race_world(planned, 1, None, np.zeros(1), 3)]
    evaluator = CarEvaluator(judged, GreedyPolicy(learner), world, flying=flying)
    spent: dict[str, list[float]] = {phase: [] for phase in PHASES}
    steps = 0
    for number in range(iterations):
        marks = [now()]
        episodes = rollout.episodes_per_iteration
        batch = collector.collect() if episodes is None else collector.collect_episodes(episodes // rollout.num_worlds)
        marks.append(now())
        learner.update(batch)
        marks.append(now())
        evaluator.evaluate()
        marks.append(now())
        if number:
            steps += batch.num_active
            for phase, before, after in zip(PHASES, marks, marks[1:], strict=False):
                spent[phase].append(after - before)
    return {phase: 1e6 * sum(seconds) / steps for phase, seconds in spent.items()}


def main() -> None:
    """Measure this version, beside another one if asked, and print a table."""
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else "")
    options.add_argument("--preset", default="fast", choices=("fast", "aws"))
    options.add_argument("--iterations", type=int, default=8, help="of each round; the first is left out")
    options.add_argument("--rounds", type=int, default=3)
    options.add_argument("--threads", type=int, default=1, help="more than one: by the clock, on a quiet machine")
    options.add_argument("--against", type=Path, help="the folder src of another checkout")
    options.add_argument("--once", action="store_true", help="measure in this process and print JSON")
    asked = options.parse_args()
    if asked.once:
        print(json.dumps(measured(asked.preset, asked.iterations, asked.threads)))
        return
    sources = {"this version": HERE.parent / "src"}
    if asked.against is not None:
        sources = {"the other": asked.against.resolve(), **sources}
    found: dict[str, list[dict[str, float]]] = {which: [] for which in sources}
    words = [sys.executable, __file__, "--once", "--preset", asked.preset, "--iterations", str(asked.iterations)]
    words += ["--threads", str(asked.threads)]
    for number in range(asked.rounds):
        for which in sorted(sources, reverse=number % 2 == 0):
            environment = {**os.environ, "PYTHONPATH": str(sources[which]), "OMP_NUM_THREADS": str(asked.threads)}
            environment["NUMBA_NUM_THREADS"] = str(asked.threads)
            done = subprocess.run(words, capture_output=True, text=True, env=environment, check=True)
            found[which].append(json.loads(done.stdout.splitlines()[-1]))
    what = "processor microseconds" if asked.threads == 1 else f"microseconds of {asked.threads} threads"
    print(f"| {what} a step | collect | learn | judge | all |\n|---|---|---|---|---|")
    for which, rounds in found.items():
        middle = [statistics.median(one[phase] for one in rounds) for phase in PHASES]
        print(f"| {which} | {' | '.join(f'{one:.0f}' for one in (*middle, sum(middle)))} |")


if __name__ == "__main__":
    main()
