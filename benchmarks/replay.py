"""How fast a replay is drawn from, with and without priorities: batches a second on one core.

    python benchmarks/replay.py [--transitions 1000000] [--batch 512] [--seconds 4]

Rows: drawing places and their weights alone (the sum tree), whole transitions of a small world (four numbers, as
CartPole shows), whole transitions with every priority set anew afterwards, and the same drawn all alike. Repeats are
interleaved and the median is told. What counts is processor time, so that a busy machine tells almost what an idle one
does; its caches are shared all the same. The last line of the output is one JSON object.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable

import numpy as np
import torch

from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.rollout.replay import Replay
from racecraft.rollout.replay_settings import ReplayConfig

ROWS, REPEATS = 8, 9
TOLD = {
    "places": "places and shares by priority",
    "transitions": "transitions by priority",
    "set_anew": "transitions by priority, set anew",
    "alike": "transitions all alike",
}


def filled(transitions: int, prioritised: bool) -> Replay:
    """Return a full replay of a small world, its priorities spread over four orders of magnitude."""
    spec = WorldSpec("small", ROWS, 1, {"state": ArraySpec((4,), np.float32)}, DiscreteActions(2))
    replay = Replay(spec, ReplayConfig(capacity=transitions, prioritised=prioritised), 0.99)
    chance, ticks = np.random.default_rng(1), 4096
    for _ in range(-(-transitions // (ROWS * ticks))):
        shape = (ticks, ROWS)
        ended = chance.random(shape) < 0.005
        replay.add(
            RolloutBatch(
                observations={"state": chance.normal(size=(*shape, 4)).astype(np.float32)},
                actions=chance.integers(0, 2, shape),
                reward=np.ones(shape, np.float32),
                terminated=ended,
                truncated=ended & ~ended,
                active=np.ones(shape, bool),
                last_observations={"state": np.zeros((ROWS, 4), np.float32)},
                last_active=np.ones(ROWS, bool),
            )
        )
    if replay.priorities is not None:
        places = replay.ring.places(replay.ring.oldest, replay.ring.head)
        replay.set_priorities(places, 10.0 ** chance.uniform(-3, 1, len(places)))
    return replay


def main() -> None:
    """Measure and print."""
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    options.add_argument("--transitions", type=int, default=1_000_000)
    options.add_argument("--batch", type=int, default=512)
    options.add_argument("--seconds", type=float, default=4.0, help="of each row, all repeats together")
    asked = options.parse_args()
    torch.set_num_threads(1)
    chance, size = torch.Generator().manual_seed(1), asked.batch
    weighed, alike = filled(asked.transitions, True), filled(asked.transitions, False)
    assert weighed.priorities is not None
    tree, errors = weighed.priorities, np.random.default_rng(2).random(size)

    def set_anew() -> None:
        weighed.set_priorities(weighed.sample(size, chance).index, errors)

    rows: dict[str, Callable[[], object]] = {
        "places": lambda: tree.draw(torch.rand(size, generator=chance, dtype=torch.float64).numpy()),
        "transitions": lambda: weighed.sample(size, chance),
        "set_anew": set_anew,
        "alike": lambda: alike.sample(size, chance),
    }
    rates: dict[str, list[float]] = {name: [] for name in rows}
    for one in rows.values():
        one()
    for _ in range(REPEATS):
        for name, one in rows.items():
            began, count, limit = time.process_time(), 0, asked.seconds / REPEATS
            while (spent := time.process_time() - began) < limit:
                one()
                count += 1
            rates[name].append(count / spent)
    figures: dict[str, float] = {"stored": asked.transitions, "batch": size}
    print(f"{asked.transitions:,} transitions, batch {size}; median (lowest, highest) of {REPEATS}")
    for name, found in rates.items():
        middle, low, high = (round(one) for one in (statistics.median(found), min(found), max(found)))
        figures |= {name: middle, f"{name}_low": low, f"{name}_high": high}
        print(f"{TOLD[name]:36} {middle:9,} ({low:,}, {high:,}) batches a processor second")
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
