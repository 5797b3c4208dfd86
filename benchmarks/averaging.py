"""What gradients that workers find cost, and on paper: with how many workers that is sooner than one learner alone.

    python benchmarks/averaging.py            measure (a minute), write json and page
    python benchmarks/averaging.py --page     write the page again from what was measured

Measured is processor time, one thread, in one process: how long a worker is at a minibatch of few and of many of its
rows, and what the learner does for each worker and for each minibatch. Everything that passes is pickled, as it is
between processes. What a link adds is worked out from the bytes.
"""

from __future__ import annotations

import json
import os
import pickle
import platform
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "averaging.json"
PAGE = HERE / "averaging.md"
ROUNDS = 7
NODES = (1, 10, 100, 1_000)
LINKS = {"1 gigabit": 1.25e8, "10 gigabit": 1.25e9, "100 gigabit": 1.25e10}
LATENCY = 2e-4
"""Seconds from the learner's asking until a worker on another machine hears it, and back."""
FEW, MANY = 32, 256
"""Rows of a worker's part, between which the time of a row is found."""


@dataclass(frozen=True)
class Costs:
    """What one minibatch costs, by which a cluster is worked out on paper."""

    row: float
    """Seconds to find the gradients of one row more."""
    start: float
    """Seconds of a worker for each minibatch, however few its rows: weights taken over, gradients found and packed."""
    worker: float
    """Seconds of the learner for each worker: gradients unpacked and added up."""
    step: float
    """Seconds of the learner for each minibatch: weights packed, gradients cut, a step of Adam."""
    alone: float
    """Seconds of a learner that finds gradients itself, for each minibatch, however few its rows; its step with it."""
    size: float
    """Bytes of the weights, and of gradients."""


def lasts(costs: Costs, rows: float, workers: int, link: float) -> float:
    """Return the seconds of a minibatch; 0 workers: the learner finds the gradients itself, with one core.

    Workers find theirs side by side. Weights go to each of them and gradients come from each over the learner's one
    link, and it adds them up one after the other.

    >>> costs = Costs(row=1e-3, start=1e-3, worker=1e-4, step=1e-3, alone=1e-3, size=0.0)
    >>> round(lasts(costs, 100, 0, 1e9), 4), round(lasts(costs, 100, 10, 1e9), 4)
    (0.101, 0.0132)
    """
    if not workers:
        return rows * costs.row + costs.alone
    return rows / workers * costs.row + costs.start + costs.step + LATENCY + workers * each(costs, link)


def each(costs: Costs, link: float) -> float:
    """Return the seconds by which a minibatch lasts longer for each worker."""
    return costs.worker + 2.0 * costs.size / link


def best(costs: Costs, rows: float, link: float) -> int:
    """Return the number of workers with which a minibatch is over soonest; 0: it is sooner without any.

    >>> best(Costs(row=1e-3, start=0.0, worker=1e-3, step=0.0, alone=0.0, size=0.0), 100, 1e9)
    10
    """
    around = int((rows * costs.row / each(costs, link)) ** 0.5)
    return min((0, max(1, around), around + 1), key=lambda workers: lasts(costs, rows, workers, link))


def pays_from(costs: Costs, workers: int, link: float) -> float:
    """Return how many rows a minibatch must have so that so many workers are sooner than none.

    >>> pays_from(Costs(row=1e-3, start=0.0, worker=1e-3, step=0.0, alone=0.0, size=0.0), 2, 1e9)
    4.4
    """
    more = costs.start + costs.step - costs.alone + LATENCY + workers * each(costs, link)
    return round(more / (costs.row * (1.0 - 1.0 / workers)), 6)


def main(arguments: list[str]) -> int:
    if "--page" not in arguments:
        RESULTS.write_text(json.dumps(measure(), indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(page(json.loads(RESULTS.read_text(encoding="utf-8"))), encoding="utf-8")
    return 0


def measure() -> dict[str, Any]:
    from racecraft.training.processor import prepare_processor

    prepare_processor(1)
    load = [os.getloadavg()[0]]
    found: dict[str, Any] = {}
    for name, make in WORLDS.items():
        costs, rows = costs_of(make)
        found[name] = {"costs": asdict(costs), "minibatch": rows}
        load.append(os.getloadavg()[0])
        print(f"{name}: {costs}", flush=True)
    machine = {"processor": platform.machine(), "system": platform.system(), "cores": os.cpu_count()}
    told = {"machine": machine, "measured": time.strftime("%Y-%m-%d"), "load": [min(load), max(load)]}
    return {**told, "rounds": ROUNDS, "worlds": found}


def costs_of(make: Callable[[], Any]) -> tuple[Costs, int]:
    """Return what a minibatch costs a learner that `make` makes, and how many rows it has by default."""
    import torch

    from racecraft.algorithms.sharded_ppo import AveragingPpo, Drawn, PpoShard, added
    from racecraft.algorithms.weights import to_arrays

    learner, other = make(), make()
    batch = rollout_of(learner)
    shard = PpoShard(other, 0, 1)
    shard.take(batch)
    weights = to_arrays(learner.network.state_dict())

    def told(rows: int) -> bytes:
        return pickle.dumps(Drawn(weights, np.arange(rows), 0.0, 1.0, 0.2, 0.01))

    def worked(asked: bytes) -> bytes:
        return pickle.dumps(shard.find(pickle.loads(asked)))

    few, many = told(FEW), told(MANY)
    short, long = spent(lambda: worked(few)), spent(lambda: worked(many))
    row = (long - short) / (MANY - FEW)
    answer = worked(few)
    first = pickle.loads(answer)

    def added_up() -> None:
        part = pickle.loads(answer)
        for name, gradient in part.gradients.items():
            added([first.gradients[name], gradient])

    averaging = AveragingPpo(learner, lambda drawn: (pickle.dumps(drawn), [first])[1])
    picked = torch.arange(FEW)
    step = spent(lambda: averaging._step(picked, 0.0, 1.0))
    size = float(sum(part.nbytes for part in weights.values()))
    whole, _, _ = learner._prepare(batch)
    alone = spent(lambda: learner._step(learner._taken(whole, picked))) - FEW * row
    costs = Costs(row, max(0.0, short - FEW * row), spent(added_up), step, max(0.0, alone), size)
    return costs, learner.config.batch_size


def spent(act: Callable[[], Any]) -> float:
    """Return the processor seconds of doing something, the median of some times."""
    act()
    rounds = []
    for _ in range(ROUNDS):
        began, times = time.process_time(), 0
        while not times or time.process_time() - began < 0.05:
            act()
            times += 1
        rounds.append((time.process_time() - began) / times)
    return statistics.median(rounds)


def rollout_of(learner: Any) -> Any:
    """Return a rollout of one row, `MANY` ticks long, of made-up numbers."""
    from racecraft.algorithms.rollout_batch import RolloutBatch

    chance = np.random.default_rng(1)
    seen = {
        name: chance.integers(0, 200, (MANY, *part.shape)).astype(part.dtype)
        for name, part in learner.spec.observations.items()
    }
    mask = np.ones((MANY, learner.spec.actions.count), bool) if learner.spec.has_action_mask else None
    decision = learner.act(seen, mask)
    none = np.zeros((MANY, 1), bool)
    return RolloutBatch(
        observations={name: array[:, None] for name, array in seen.items()},
        actions=decision.actions[:, None],
        reward=chance.normal(size=(MANY, 1)).astype(np.float32),
        terminated=none,
        truncated=none,
        active=~none,
        last_observations={name: array[:1] for name, array in seen.items()},
        last_active=np.ones(1, bool),
        columns={name: part[:, None] for name, part in decision.columns.items()},
        action_mask=None if mask is None else mask[:, None],
    )


def car(preset: str) -> Any:
    """Return a learner as a car of a preset has it."""
    from racecraft.algorithms.building import build_learner
    from racecraft.worlds.deepracer.training.plan import RaceRequest
    from racecraft.worlds.deepracer.training.trainer import driven_world, plan

    planned = plan(RaceRequest(preset=preset, overrides=("rollout.num_worlds=1", "ppo.precision=float32")))
    return build_learner(planned.algorithm, driven_world(planned, None).spec, planned.settings, 1)


def snake() -> Any:
    """Return a learner as snakes have it."""
    from racecraft.algorithms.building import build_learner
    from racecraft.algorithms.registry import find_algorithm
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.env.world import WorldSettings
    from racecraft.worlds.battlesnake.training.self_play import SelfPlayWorld, world_settings
    from racecraft.worlds.battlesnake.training.trainer import default_settings

    algorithm = find_algorithm("ppo")
    settings = default_settings(algorithm)
    game = WorldSettings(GameSettings(11, 11, 4, "standard", "standard"))
    spec = SelfPlayWorld(world_settings(game, settings.snake, 8), settings.selfplay).spec
    return build_learner(algorithm, spec, settings, 1)


WORLDS = {
    "the car, preset fast": lambda: car("fast"),
    "the car, preset aws": lambda: car("aws"),
    "four snakes": snake,
}


def page(results: dict[str, Any]) -> str:
    """Return the page of what was measured, and of what it says on paper."""
    machine, load = results["machine"], results["load"]
    lines = [
        "# Gradients that workers find, measured and on paper",
        "",
        "<!-- Written by benchmarks/averaging.py from benchmarks/averaging.json. -->",
        "",
        f"Measured {results['measured']} in processor time of one thread ({machine['system']}, {machine['processor']}, "
        f"{machine['cores']} cores, load {load[0]:.1f} to {load[1]:.1f} meanwhile), medians of {results['rounds']}.",
        "",
        "| learner | weights, and gradients | a row | a minibatch, at each worker | at the learner, for each worker | "
        "at the learner | at a learner alone | rows of a minibatch by default |",
        "|---|---|---|---|---|---|---|---|",
    ]
    worlds = {name: (Costs(**told["costs"]), told["minibatch"]) for name, told in results["worlds"].items()}
    for name, (costs, rows) in worlds.items():
        lines.append(
            f"| {name} | {costs.size / 1e6:,.2f} MB | {costs.row * 1e6:,.0f} µs | {costs.start * 1e3:,.2f} ms | "
            f"{costs.worker * 1e3:,.2f} ms | {costs.step * 1e3:,.2f} ms | {costs.alone * 1e3:,.2f} ms | {rows:,} |"
        )
    lines += [
        "",
        "## On paper",
        "",
        "A minibatch of B rows lasts, with N workers and with none (`lasts` in `benchmarks/averaging.py`):",
        "",
        "    B / N x row  +  at each worker  +  N x (at the learner + 2 x bytes / link)  +  at the learner  +  0.2 ms",
        "    B x row  +  at a learner alone",
        "",
        "One core against one core each; a learner of many cores, or a GPU, has a cheaper row. How many rows make it "
        "worth while, and which number of workers is best for the minibatch that is the default and for ones of 16 and "
        "256 times as many rows (in brackets: how much sooner it is over than with none):",
        "",
        "| learner, link | 2 workers pay from | 16 pay from | best, by default | 16 times the rows | 256 times |",
        "|---|---|---|---|---|---|",
    ]
    for name, (costs, rows) in worlds.items():
        for link_name, link in LINKS.items():
            wanted = [_best_told(costs, rows * times, link) for times in (1, 16, 256)]
            pays = [f"{pays_from(costs, workers, link):,.0f} rows" for workers in (2, 16)]
            lines.append(f"| {name}, {link_name} | {' | '.join(pays + wanted)} |")
    lines += [
        "",
        "With a minibatch that grows with the nodes, 16 workers on each and for each the rows of the default, over 10 "
        "gigabit; how long it lasts, and how much of that the learner's link and its adding up take:",
        "",
        "| learner | " + " | ".join(f"{nodes:,} node{'s' * (nodes > 1)}" for nodes in NODES) + " |",
        "|---|" + "---|" * len(NODES),
    ]
    for name, (costs, rows) in worlds.items():
        told = []
        for nodes in NODES:
            workers, link = 16 * nodes, LINKS["10 gigabit"]
            whole = lasts(costs, rows * workers, workers, link)
            told.append(f"{whole * 1e3:,.0f} ms, {workers * each(costs, link) / whole:.0%}")
        lines.append(f"| {name} | {' | '.join(told)} |")
    lines += [
        "",
        "So what breaks is the one place that adds up: its time grows with the workers and that of a worker does not "
        "shrink. Where the last line says more than half, workers mostly wait; a tree of adders would move that point, "
        "and there is none.",
        "",
    ]
    return "\n".join(lines)


def _best_told(costs: Costs, rows: int, link: float) -> str:
    workers = best(costs, rows, link)
    if not workers:
        return "none"
    return f"{workers:,} ({lasts(costs, rows, 0, link) / lasts(costs, rows, workers, link):,.1f}×)"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
