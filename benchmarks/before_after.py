"""Training speed of this version beside another one, case by case, in turns: `before_after.py OTHER_CHECKOUT/src`.

Each case is trained for a fixed number of iterations by either version, first one first, next round the other. What is
compared is environment steps over the seconds of collecting and learning; judging, writing and the first iteration,
which may compile, are left out. Medians of the ratios of each round are told, with their range. Run it when nothing
else runs. What was found stands in `before-after.md`.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
CASES = {
    "car, default": ("train", "--stop", "iterations=16", "--no-pictures"),
    "CartPole-v1": ("gym", "train", "CartPole-v1", "--stop", "iterations=80"),
    "Unity, builtin:Basic": ("unity", "train", "builtin:Basic", "--stop", "iterations=8"),
    "snakes, self-play": ("snakes", "train", "--stop", "iterations=8", "--set", "evaluation.every=100"),
}


def steps_per_second(source: Path, words: tuple[str, ...], seed: int) -> float:
    """Train with the package at `source`; return steps over the seconds of collecting and learning, 1/s."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "racecraft", *words, "--seed", str(seed), "--run", "run"]
        environment = {**os.environ, "PYTHONPATH": str(source)}
        subprocess.run(command, cwd=folder, env=environment, capture_output=True)  # a goal not reached is exit code 1
        lines = (Path(folder) / "run" / "metrics.jsonl").read_text(encoding="utf-8").splitlines()
    first, *rest = map(json.loads, lines)
    seconds = sum(row["seconds_collect"] + row["seconds_learn"] for row in rest)
    return float((rest[-1]["steps"] - first["steps"]) / seconds)


def main() -> None:
    """Compare, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("other", type=Path, help="the folder src of another checkout")
    parser.add_argument("--rounds", type=int, default=5, help="how often each case is trained by either version")
    asked = parser.parse_args()
    sources = {"before": asked.other.resolve(), "after": HERE.parent / "src"}
    print("| case | before, steps/s | after, steps/s | after over before | range |\n|---|---|---|---|---|")
    for case, words in CASES.items():
        found: dict[str, list[float]] = {"before": [], "after": []}
        for number in range(asked.rounds):
            for which in sorted(sources, reverse=number % 2 == 0):
                found[which].append(steps_per_second(sources[which], words, seed=number + 1))
        before, after = found["before"], found["after"]
        ratios = sorted(mine / theirs for mine, theirs in zip(after, before, strict=True))
        middle = f"{statistics.median(before):,.0f} | {statistics.median(after):,.0f}"
        print(f"| {case} | {middle} | {statistics.median(ratios):.2f} | {ratios[0]:.2f} – {ratios[-1]:.2f} |")


if __name__ == "__main__":
    main()
