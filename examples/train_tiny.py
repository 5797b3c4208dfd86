"""Train a car from Python, for two iterations only, then judge what it can do so far."""

import sys
import tempfile
from pathlib import Path

from racecraft.evaluation.deepracer.laps import judge_starts
from racecraft.players.deepracer.trained_car import load_trained_car
from racecraft.tracks.catalogue import load_track
from racecraft.training.deepracer.plan import RaceRequest
from racecraft.training.progress import LineWatcher
from racecraft.training.worlds import train

with tempfile.TemporaryDirectory() as folder:
    request = RaceRequest(
        track="Oval_track",
        stops=("iterations=2",),  # ("laps", "minutes=10") to train in earnest
        run=Path(folder) / "tiny",
        overrides=("rollout.num_worlds=8", "rollout.horizon=32", "evaluation.episodes=2", "runtime.threads=1"),
    )
    trained = train(request, LineWatcher(sys.stdout), print)

    car = load_trained_car(trained.run.path, "best")
    report = judge_starts(car.policy, car.world(load_track("Oval_track"), num_cars=2))
    print(f"{trained.outcome.steps} steps: {report.mean_progress_percent:.1f} % of a lap, {report.full_laps} full laps")
