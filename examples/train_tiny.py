"""Train a car from Python, for two iterations only, then judge what it can do so far."""

import tempfile
from pathlib import Path

import racecraft as rc

with tempfile.TemporaryDirectory() as folder:
    trained = rc.train(
        "deepracer",
        track="Oval_track",
        stops="iterations=2",  # ["laps", "minutes=10"] to train in earnest
        settings={
            "rollout.num_worlds": 8,
            "rollout.horizon": 32,
            "evaluation.episodes": 2,
            "race.max_episode_seconds": 10,
            "runtime.threads": 1,
        },
        run=Path(folder) / "tiny",
    )
    judged = rc.evaluate(trained.run.path, laps=1)
    curve = rc.read_run(trained.run.path).metrics()

print(
    f"{trained.outcome.steps} steps: {judged['mean_progress_percent']:.1f} % of a lap, {judged['full_laps']} full laps"
)
print(curve.select("iteration", "training_score", "evaluation_score"))
