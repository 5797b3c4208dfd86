"""CartPole-v1 through `racecraft gym train`: seconds from the command to solved, process start included."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
import time

SEEDS = (1, 2, 3, 4, 5)


def seconds_to_solved(seed: int) -> float:
    """Train once; infinite where it was not solved."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "racecraft", "gym", "train", "CartPole-v1", "--seed", str(seed)]
        began = time.perf_counter()
        done = subprocess.run([*command, "--run", f"{folder}/r", "--json"], capture_output=True, text=True, check=True)
        spent = time.perf_counter() - began
    return spent if json.loads(done.stdout)["solved"] else float("inf")


def main() -> None:
    seconds = [round(seconds_to_solved(seed), 1) for seed in SEEDS]
    print(json.dumps({"seconds": seconds, "median_seconds": statistics.median(seconds), "seeds": SEEDS}))


if __name__ == "__main__":
    main()
