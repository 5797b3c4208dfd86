"""How fast the default car becomes, and how surely it finishes: trained by `train`, judged from 100 standing starts.

    python benchmarks/racing.py OUT.json [--seeds 3] [--steps 200000] [--set GROUP.NAME=VALUE …] [--lap-ends]

Each seed trains in one thread; what is told is CPU seconds of the process, judging and files in, compilation out. Then
the best checkpoint drives, greedily, from 100 standing starts that training did not judge (shares (i + 0.37) / 100 of
the lap), three laps each. `--lap-ends` trains as before laps went on: a complete lap ends an episode.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.rollout.episodes import play_episodes
from racecraft.training.callbacks import IterationReport, NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.driving.smoothness import smoothness_of
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.training import trainer
from racecraft.worlds.deepracer.training.plan import RaceRequest

STARTS, LAPS = 100, 3


class Curve(NullCallback):
    """Keeps what every evaluation came to."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self.began = time.process_time()

    def iteration(self, report: IterationReport) -> None:
        """Keep CPU seconds, steps, share of full laps and their median."""
        if report.result is None:
            return
        laps = report.result.details["laps"]
        seconds = [lap["seconds"] for lap in laps if lap["seconds"] is not None]
        self.rows.append({
            "cpu_seconds": round(time.process_time() - self.began, 2),
            "steps": report.steps,
            "full_share": len(seconds) / len(laps),
            "median_lap_seconds": float(np.median(seconds)) if seconds else None,
        })  # fmt: skip


def main() -> None:
    """Train and judge every seed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=200_000)
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--lap-ends", action="store_true")
    asked = parser.parse_args()
    if asked.lap_ends:
        trainer.drive_seconds = lambda planned, course: None
    rows = []
    for seed in range(1, asked.seeds + 1):
        with tempfile.TemporaryDirectory() as folder:
            curve, overrides = Curve(), ("runtime.threads=1", *asked.set)
            request = RaceRequest(
                run=Path(folder) / "run", preset="race", seed=seed, stops=(f"steps={asked.steps}",), overrides=overrides
            )
            run = train(request, curve, lambda text: None).run
            rows.append({"seed": seed, **judged(run.path), "curve": curve.rows})
            print({name: value for name, value in rows[-1].items() if name != "curve"}, flush=True)
        asked.out.write_text(json.dumps({"asked": {**vars(asked), "out": None}, "seeds": rows}, indent=1))


def judged(run: Path) -> dict[str, Any]:
    """Let the best checkpoint drive from standing starts; return what came of it."""
    car = load_trained_car(run, "best")
    world = car.world(car.trained_on, STARTS, ((np.arange(STARTS) + 0.37) / STARTS).tolist(), laps=LAPS)
    kept: list[np.ndarray] = []
    play_episodes(
        car.policy, world, seed=0, observers=[lambda world, buffers, actions: kept.append(world.reports[:, 0].copy())]
    )
    finished, flying, calm = 0, [], []
    for reports in np.stack(kept, axis=1):
        own = reports[(reports["episode"] == 0) & (reports["status"] != race.PARK)]
        laps = own["lap_seconds"][own["status"] == race.LAP_COMPLETE]
        finished += len(laps) == LAPS
        flying += laps[1:].tolist()
        calm.append(smoothness_of(own))
    steering = np.mean([one for one in calm if one is not None], axis=0)
    return {
        "checkpoint": car.checkpoint.iteration,
        "finished_share": finished / STARTS,
        "median_flying_lap_seconds": round(float(np.median(flying)), 3) if flying else None,
        "fastest_flying_lap_seconds": round(min(flying), 3) if flying else None,
        "steering_change_degrees_per_second": round(float(np.degrees(steering[0])), 1),
        "steering_sign_turns_share": round(float(steering[1]), 4),
    }


if __name__ == "__main__":
    main()
