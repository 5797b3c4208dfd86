"""Does a car that begins with ten driven laps lap sooner than one that begins with nothing? Three seeds of each.

    python benchmarks/driven_laps.py [--output FOLDER] [--seeds 3] [--track reinvent_base]

A scripted person drives the laps through the same `HandDrive` as the page does: towards the centre line a metre ahead,
with an unsteady hand. Then `racecraft train --stop laps` runs with and without `--from laps.safetensors`; the steps
until it laps are compared.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

import numpy as np

from racecraft.worlds.deepracer.driving.by_hand import HandDrive
from racecraft.worlds.deepracer.driving.driven_laps import DrivenLaps
from racecraft.worlds.deepracer.training.driven_world import world_by_hand
from racecraft.worlds.deepracer.training.new_model import new_model

LAPS, UNSTEADY = 10, 0.15
"""How many laps, and the spread of the hand, share of full lock."""
MAX_STEPS = 200_000


def main(words: list[str]) -> int:
    """Drive, train, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--output", type=Path, default=None)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--track", default="reinvent_base")
    options = parser.parse_args(words)
    output = options.output or Path(tempfile.mkdtemp(prefix="driven-laps-"))
    car = output / "car"
    if not car.exists():
        new_model(car)
    laps = drive(car, options.track)
    print(
        f"{len(laps.laps)} laps driven, best {min(lap.seconds for lap in laps.laps):.2f} s, in {laps.path}", flush=True
    )
    found = {
        name: [train(output, options.track, seed, name, source) for seed in range(1, options.seeds + 1)]
        for name, source in (("driven laps", laps.path), ("nothing", None))
    }
    print("begins with | steps until it laps, each seed | median | seconds of training, median")
    for name, runs in found.items():
        steps = [run["env_steps"] for run in runs]
        print(f"{name} | {', '.join(map(str, steps))} | {median(steps):g} | {median(run['seconds'] for run in runs):g}")
    return 0


def drive(car: Path, track: str) -> DrivenLaps:
    """Return ten laps by an unsteady hand; drives that leave the road are not kept, as on the page."""
    laps = DrivenLaps(car / f"laps-{track}.safetensors", track)
    world, rng = world_by_hand(car, track), np.random.default_rng(0)
    hand = HandDrive(world)
    moment = hand.restart()
    while len(laps.laps) < LAPS:
        ahead = world.track.pose_at(world.track.locate([[moment.x, moment.y]]).arc[0] + 1.0)
        off = math.atan2(ahead.y - moment.y, ahead.x - moment.x) - moment.yaw
        off = math.atan2(math.sin(off), math.cos(off))
        moment, lap = hand.tick(4.0 * off + rng.normal(0.0, UNSTEADY), float(abs(off) < 0.1))
        if lap is not None:
            laps.add(lap)
    return laps


def train(output: Path, track: str, seed: int, name: str, source: Path | None) -> dict[str, float]:
    """Return what a training tells that stops when it laps."""
    run = output / f"{name.replace(' ', '-')}-{seed}"
    words = [
        "train",
        str(output / "car"),
        f"--track={track}",
        f"--seed={seed}",
        f"--run={run}",
        "--no-pictures",
        "--json",
    ]
    words += ["--stop=laps", f"--stop=steps={MAX_STEPS}", *([f"--from={source}"] if source else [])]
    done = subprocess.run([sys.executable, "-m", "racecraft", *words], capture_output=True, text=True, check=True)
    told: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    print(f"{name}, seed {seed}: {told['env_steps']} steps, {told['stopped_by']}", flush=True)
    return told


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
