"""From the command to the first training tick, warm and on the first run ever; and the memory of `make demo`.

The clock runs from the start of the process to the line that is printed right before the first tick. `racecraft train`
and `dr-start-training`, which trains in the background and shows the log, take turns with the same folder.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STOP = "iterations=1"


def seconds_to_first_tick(cache: str | None) -> float:
    """Start `racecraft train` and return the seconds until it is about to take its first tick."""
    environment = {**os.environ, **({"RACECRAFT_CACHE": cache} if cache else {})}
    with tempfile.TemporaryDirectory() as folder:
        return seconds_until_tick("train", "--stop", STOP, "--no-pictures", "--run", f"{folder}/r", env=environment)


def seconds_to_first_ticks(rounds: int) -> tuple[list[float], list[float]]:
    """Return the seconds of `racecraft train FOLDER` and of `dr-start-training` there, in turns."""
    plain, jobs = [], []
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            environment = {**os.environ, "RACECRAFT_JOBS": f"{folder}/jobs", "RACECRAFT_STOP": STOP}
            here = f"{folder}/drfc"
            for words in (("init", here), ("dr", "--folder", here, "upload-custom-files")):
                command = [sys.executable, "-m", "racecraft", *words]
                subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment)
            words = ("train", here, "--stop", STOP, "--no-pictures", "--run", f"{folder}/r")
            plain.append(seconds_until_tick(*words, env=environment))
            jobs.append(seconds_until_tick("dr", "--folder", here, "start-training", env=environment))
            supervisor = json.loads(Path(f"{folder}/jobs/run.lock").read_text())["pid"]
            os.kill(supervisor, signal.SIGTERM)
            while Path(f"{folder}/jobs/run.lock").stat().st_size:
                time.sleep(0.05)
    return plain, jobs


def seconds_until_tick(*words: str, env: dict[str, str]) -> float:
    """Run a command that trains to its end; return the seconds until it said that it begins."""
    began = time.perf_counter()
    command = [sys.executable, "-m", "racecraft", *words]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=env)
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
    plain, jobs = seconds_to_first_ticks(5)
    figures = {
        "warm_seconds": round(statistics.median(warm), 2),
        "warm_low": round(min(warm), 2),
        "warm_high": round(max(warm), 2),
        "train_folder_seconds": round(statistics.median(plain), 2),
        "dr_start_training_seconds": round(statistics.median(jobs), 2),
        "first_run_ever_seconds": round(cold, 1),
        "demo_memory_mb": round(demo_memory_mb()),
    }
    print(json.dumps(figures))
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
