"""What a process of its own for the reward costs a training: `python benchmarks/reward_process.py OUT.json`.

The default car trains for `--steps` on re:Invent 2018 by turns: its Python reward in a process of its own, and in the
training's process (`--trust-reward`). Same seed, so both learn the same. Clock seconds are those of the training loop,
compilation out; processor seconds are those of both processes. The ratio is of neighbours in time. The page is
reward-process.md; copied by hand.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import tempfile
from pathlib import Path

from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.training.new_model import new_model
from racecraft.worlds.deepracer.training.plan import RaceRequest


def main() -> None:
    """Train by turns and print the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--turns", type=int, default=5)
    parser.add_argument("--steps", type=int, default=40_000)
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "car"
        new_model(model)
        for turn in range(options.turns + 1):
            order = (False, True) if turn % 2 else (True, False)  # a machine that slows down meets both alike
            seconds = {trust: trained(model, options.steps, trust) for trust in order}
            if turn:  # the first one compiles
                rows.append({"own_process": seconds[False], "trusted": seconds[True]})
                print(rows[-1], flush=True)
    for what in ("clock", "processor"):
        ratios = [row["own_process"][what] / row["trusted"][what] for row in rows]
        print(f"{what}: median ratio {statistics.median(ratios):.3f}, {min(ratios):.3f} to {max(ratios):.3f}")
    options.out.write_text(json.dumps({"steps": options.steps, "turns": rows}, indent=1))


def trained(model: Path, steps: int, trust_reward: bool) -> dict[str, float]:
    """Return the seconds that a training took: of the clock, and of all its processors."""
    before = _processor_seconds()
    with tempfile.TemporaryDirectory() as folder:
        request = RaceRequest(
            folder=model, run=Path(folder) / "run", seed=1, stops=(f"steps={steps}",), trust_reward=trust_reward
        )
        finished = train(request, NullCallback(), lambda text: None)
    return {"clock": finished.outcome.seconds, "processor": _processor_seconds() - before}


def _processor_seconds() -> float:
    used = (resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in used)


if __name__ == "__main__":
    main()
