"""How fast a car becomes, and how surely it finishes: trained by `train` with the preset race, judged from 100 starts.

    python benchmarks/racing.py OUT.json [--seed 1 --seed 2 …] [--stop steps=200000] [--track NAME] [--folder CAR]
                                [--car v5-classic] [--algorithm sac] [--set GROUP.NAME=VALUE …] [--lap-ends]
                                [--keep FOLDER]

Without options it is the default car on its track. Each seed trains in one thread; what is told is CPU seconds of the
process, judging and files in, compilation out, and those of the process that computes the reward beside it. Then the
best checkpoint drives, greedily, from 100 standing starts that training did not judge (shares (i + 0.37) / 100 of
the lap), three laps each. `--lap-ends` trains as before laps went on: a complete lap ends an episode. `--keep` leaves
the runs in a folder, by seed.
"""

from __future__ import annotations

import argparse
import json
import resource
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.rollout.episodes import play_episodes
from racecraft.training.callbacks import IterationReport, NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.driving.known_laps import gap_percent
from racecraft.worlds.deepracer.driving.smoothness import smoothness_of
from racecraft.worlds.deepracer.driving.telemetry.corners import find_corners
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.tracks.track import Track
from racecraft.worlds.deepracer.training import trainer
from racecraft.worlds.deepracer.training.plan import RaceRequest, known_lap_of, plan_car

STARTS, LAPS = 100, 3


class Curve(NullCallback):
    """Keeps what every evaluation came to."""

    def __init__(self) -> None:
        self.rows: list[dict[str, Any]] = []
        self.full_in_a_row, self.stable = 0, None
        """What it took until two evaluations in a row brought a full lap from every start."""
        self.began = time.process_time()

    def begin(self, title: str, until: str, score_name: str) -> None:
        """Start counting: everything is compiled."""
        self.began = time.process_time()

    def iteration(self, report: IterationReport) -> None:
        """Keep CPU seconds, steps, share of full laps and their median."""
        if report.result is None:
            return
        laps = report.result.details["laps"]
        seconds = [lap["seconds"] for lap in laps if lap["seconds"] is not None]
        self.full_in_a_row = self.full_in_a_row + 1 if report.result.solved else 0
        if self.full_in_a_row == 2 and self.stable is None:
            self.stable = {"cpu_seconds": round(time.process_time() - self.began, 1), "steps": report.steps}
        self.rows.append({
            "cpu_seconds": round(time.process_time() - self.began, 2),
            "steps": report.steps,
            "full_share": len(seconds) / len(laps),
            "median_lap_seconds": float(np.median(seconds)) if seconds else None,
        })  # fmt: skip


def main() -> None:
    """Train and judge every seed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, action="append", default=[])
    parser.add_argument("--stop", action="append", default=[])
    parser.add_argument("--set", action="append", default=[])
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--keep", type=Path)
    for name in ("track", "car", "algorithm"):
        parser.add_argument(f"--{name}")
    parser.add_argument("--lap-ends", action="store_true")
    options = parser.parse_args()
    if options.lap_ends:
        trainer.drive_seconds = lambda planned, course: None
    rows = []
    for seed in options.seed or (1, 2, 3):
        with tempfile.TemporaryDirectory() as folder:
            request = RaceRequest(
                run=(options.keep or Path(folder)) / f"seed-{seed}", preset="race", seed=seed,
                stops=tuple(options.stop), overrides=("runtime.threads=1", *options.set), folder=options.folder,
                track=options.track, car=options.car, algorithm=options.algorithm,
            )  # fmt: skip
            rows.append({"seed": seed, **trained(request)})
            print({name: value for name, value in rows[-1].items() if name != "curve"}, flush=True)
        command = {name: str(value) for name, value in vars(options).items() if value and name != "out"}
        options.out.write_text(json.dumps({"command": command, "seeds": rows}, indent=1))


def trained(request: RaceRequest) -> dict[str, Any]:
    """Train a car and judge it; return what it took and what came of it."""
    curve, children = Curve(), resource.getrusage(resource.RUSAGE_CHILDREN)
    finished = train(request, curve, lambda text: None)
    spent, after = time.process_time() - curve.began, resource.getrusage(resource.RUSAGE_CHILDREN)
    known = known_lap_of(plan_car(request))
    result = judged(finished.run.path)
    flying = result["median_flying_lap_seconds"]
    return {
        "steps": finished.outcome.steps,
        "cpu_seconds": round(spent, 1),
        "reward_cpu_seconds": round(after.ru_utime + after.ru_stime - children.ru_utime - children.ru_stime, 1),
        "clock_seconds": round(finished.outcome.seconds, 1),
        "stable": curve.stable,
        "gap_percent": None if flying is None or known is None else round(gap_percent(flying, known), 2),
        **result,
        "curve": curve.rows,
    }


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
    median = float(np.median(flying)) if flying else None
    return {
        "checkpoint": car.checkpoint.iteration,
        "finished_share": finished / STARTS,
        "median_flying_lap_seconds": None if median is None else round(median, 3),
        "fastest_flying_lap_seconds": round(min(flying), 3) if flying else None,
        "steering_change_degrees_per_second": round(float(np.degrees(steering[0])), 1),
        "steering_sign_turns_share": round(float(steering[1]), 4),
        "sign_turns_a_lap": None if median is None else round(steering[1] * median * TICKS_PER_SECOND, 1),
        "road_changes_sides_a_lap": side_changes(car.trained_on),
    }


def side_changes(track: Track) -> int:
    """Return how often a lap of a circuit goes from a corner to one of the other side."""
    sides = [corner.side for corner in find_corners(track)]
    return sum(side != other for side, other in zip(sides, sides[1:] + sides[:1], strict=True))


if __name__ == "__main__":
    main()
