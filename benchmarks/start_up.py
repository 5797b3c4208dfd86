"""From the command to the first training tick, warm and on the first run ever; and the memory of `make demo`.

The clock runs from the start of the process to the line that is printed right before the first tick.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path


def seconds_to_first_tick(cache: str | None) -> float:
    """Start `racecraft train` and return the seconds until it is about to take its first tick."""
    environment = {**os.environ, **({"RACECRAFT_CACHE": cache} if cache else {})}
    with tempfile.TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-m",
            "racecraft",
            "train",
            "--stop",
            "iterations=1",
            "--no-pictures",
            "--run",
            f"{folder}/r",
        ]
        began = time.perf_counter()
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
        seconds = float("nan")
        for line in process.stdout:
            if "; stops at " in line:
                seconds = time.perf_counter() - began
        process.wait()
    return seconds


def demo_memory_mb() -> float:
    """Run `racecraft train` to the end, pictures and all; return its largest resident memory, MB."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "racecraft", "train", "--run", f"{folder}/r"]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="write the figures here")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as cache:
        cold = seconds_to_first_tick(cache)
    seconds_to_first_tick(None)
    warm = [seconds_to_first_tick(None) for _ in range(5)]
    figures = {
        "warm_seconds": round(statistics.median(warm), 2),
        "warm_low": round(min(warm), 2),
        "warm_high": round(max(warm), 2),
        "first_run_ever_seconds": round(cold, 1),
        "demo_memory_mb": round(demo_memory_mb()),
    }
    print(json.dumps(figures))
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
