"""What a racer waits for beside the default car on its short track; nothing else should run.

    python benchmarks/car_goals.py                       all of it, some twelve minutes on two cores
    python benchmarks/car_goals.py --only july --seeds 1

july: seconds until the default car laps July_2020 (60 m) stably, as `racecraft bench laps` counts them. sac: seconds
until a car of ranges (-30 to 30 degrees, 1 to 4 m/s, front camera, re:Invent 2018) that learns by SAC does so. aws:
training steps a second of the preset `aws`, exact networks, in `--minutes`, evaluations in and out. The last line of
the output is one JSON object.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
from pathlib import Path
from typing import Any

from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.training.plan import RaceRequest

NEVER = float("inf")
RANGES = {
    "action_space_type": "continuous",
    "action_space": {"steering_angle": {"high": 30.0, "low": -30.0}, "speed": {"high": 4.0, "low": 1.0}},
    "sensor": ["FRONT_FACING_CAMERA"],
    "training_algorithm": "sac",
    "version": "5",
}


def seconds_to_laps(seeds: int, place: Path, minutes: float, **request: Any) -> dict[str, Any]:
    """Train once for each seed until laps are stable; who is not by then counts as endless."""
    reached: list[float | None] = []
    for seed in range(1, seeds + 1):
        stops = ("laps", f"minutes={minutes:g}")
        trained = train(
            RaceRequest(run=place / str(seed), seed=seed, stops=stops, **request), NullCallback(), lambda text: None
        )
        stable = trained.outcome.seconds_to_stable
        reached.append(None if stable is None else round(stable, 1))
        print(f"  seed {seed}: {reached[-1]} s, {trained.outcome.steps} steps", file=sys.stderr, flush=True)
    middle = statistics.median(NEVER if one is None else one for one in reached)
    return {"seconds": reached, "median_seconds": round(middle, 1)}


def july(seeds: int, place: Path, minutes: float) -> dict[str, Any]:
    """The default car on a long track."""
    return seconds_to_laps(seeds, place, 5, track="July_2020", preset="fast")


def sac(seeds: int, place: Path, minutes: float) -> dict[str, Any]:
    """A car of ranges, off-policy."""
    folder = place / "car"
    folder.mkdir(parents=True)
    (folder / "model_metadata.json").write_text(json.dumps(RANGES), encoding="utf-8")
    return seconds_to_laps(seeds, place, 15, folder=folder, preset="fast")


def aws(seeds: int, place: Path, minutes: float) -> dict[str, Any]:
    """The original's networks and figures."""
    train(
        RaceRequest(run=place / "run", seed=1, preset="aws", stops=(f"minutes={minutes:g}",)),
        NullCallback(),
        lambda text: None,
    )
    rows = [json.loads(line) for line in (place / "run" / "metrics.jsonl").read_text("utf-8").splitlines()]
    steps, work = rows[-1]["steps"], sum(row["seconds_collect"] + row["seconds_learn"] for row in rows)
    return {
        "minutes": minutes,
        "steps_per_second": round(steps / rows[-1]["seconds"]),
        "steps_per_second_judging_out": round(steps / work),
    }


PARTS = {"july": july, "sac": sac, "aws": aws}


def main() -> None:
    """Measure and print."""
    options = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    options.add_argument("--only", choices=PARTS, action="append")
    options.add_argument("--seeds", type=int, default=3)
    options.add_argument("--minutes", type=float, default=4.0, help="of the preset aws")
    asked = options.parse_args()
    figures = {}
    for name in asked.only or PARTS:
        print(name, file=sys.stderr, flush=True)
        with tempfile.TemporaryDirectory() as place:
            figures[name] = PARTS[name](asked.seeds, Path(place), asked.minutes)
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
