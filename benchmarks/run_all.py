"""Run the benchmarks one after the other and write `benchmarks/README.md`, the table of what this machine can do.

    make bench                                  everything, about 50 minutes; nothing else should run
    python benchmarks/run_all.py start_up laps  some of it; the other rows stay as they were

Figures live in `benchmarks/results.json`; the README is made from them and from nothing else.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from typing import Any

from rows import ROWS, told

HERE = Path(__file__).parent
RESULTS = HERE / "results.json"
PAGE = HERE / "README.md"

COMMANDS = {
    "world": ["-m", "racecraft", "bench", "world", "--json"],
    "laps": ["-m", "racecraft", "bench", "laps", "--json"],
    "car_goals": [str(HERE / "car_goals.py")],
    "sb3": [str(HERE / "sb3_cars.py")],
    "start_up": [str(HERE / "start_up.py")],
    "cartpole": [str(HERE / "cartpole.py")],
    "replay": [str(HERE / "replay.py")],
    "battlesnake": [str(HERE / "battlesnake.py")],
    "unity": [str(HERE / "unity.py")],
    "snake_search": [str(HERE / "snake_search.py")],
    "snake_server": [str(HERE / "snake_server.py")],
    "snakes_training": [str(HERE / "snakes_training.py")],
}
"""Each prints its figures as one JSON object on its last line."""


def main() -> None:
    """Run what is asked for, keep the figures, write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"by default all of {', '.join(COMMANDS)}")
    names = parser.parse_args().names
    if unknown := [name for name in names if name not in COMMANDS]:
        parser.error(f"no benchmark {', '.join(unknown)}; there are {', '.join(COMMANDS)}")
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for name in names or COMMANDS:
        print(f"{name} …", flush=True)
        done = subprocess.run([sys.executable, *COMMANDS[name]], capture_output=True, text=True, check=True)
        figures = json.loads(done.stdout.strip().splitlines()[-1])
        results[name] = {**figures, "machine": machine(), "date": datetime.date.today().isoformat()}
        RESULTS.write_text(json.dumps(results, indent=2) + "\n")
        PAGE.write_text(page(results))
    print(PAGE.read_text())


def machine() -> str:
    """Return the machine in words."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [
            line.split(":")[1].strip() for line in cpuinfo.read_text().splitlines() if line.startswith("model name")
        ]
        model = names[0] if names else model
    return f"{model}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"


def page(results: dict[str, Any]) -> str:
    """Return the table as Markdown."""
    rows = [told(row) for name, make in ROWS.items() if name in results for row in make(results[name])]
    machines = sorted({f"{part['machine']}, measured {part['date']}" for part in results.values()})
    return "\n".join(
        [
            "# Benchmarks",
            "",
            "Made by `make bench` from `results.json`; scripts stand beside this page. "
            f"Machine: {'; '.join(machines)}. A dash in the last column means that there is no spread to tell. "
            'Of seconds, memory and late answers "at least" means at most; a row that does not keep it says that it '
            "misses. A speed-up is counted from the best figure that one core reached in the same run.",
            "",
            "| what | measured | at least | aim | spread |",
            "|---|---|---|---|---|",
            *(f"| {what} | {value} | {floor} | {aim} | {spread} |" for what, value, floor, aim, spread in rows),
            "",
            "The benchmark car is that of the preset `fast`, which crawls: profile v6 (these figures: v6-unlimited), "
            "ten actions (±30°, ±15°, 0° at 0.5 and 1.0 m/s), the centre-line reward, re:Invent 2018. The default car "
            "races: [racing.md](racing.md), by `python benchmarks/racing.py`. Seconds to stable laps run from the "
            "first training tick to the second "
            "evaluation in a row in which all five starts bring a full lap, evaluations in, compilation out. "
            "Stable-Baselines3 drives the same world with the same minibatches, epochs, step size, discount and policy "
            "network, judged the same way, seeds interleaved with ours in the same run. It was given our "
            "settings; no search for better ones of its own was made.",
            "",
            "The learning curve of the preset `aws` beside real AWS trainings has a page of its own, "
            "[aws-curve.md](aws-curve.md), made by `python benchmarks/aws_curve.py`; so has one model that learns 20 "
            "tracks and is judged on ten others, [many-tracks.md](many-tracks.md), by `benchmarks/many_tracks.py`, and "
            "so have cars among boxes, bots and each other, [cars-among-others.md](cars-among-others.md), workers "
            "of a Ray cluster, [cluster.md](cluster.md), duels against public snakes, "
            "[snake-opponents.md](snake-opponents.md), and how soon others solve Gymnasium's worlds, "
            "[peers.md](peers.md).",
            "",
        ]
    )


if __name__ == "__main__":
    main()
