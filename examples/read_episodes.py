"""Read what a training wrote down, tick by tick, with polars: which actions pay, and how episodes end.

Usage: read_episodes.py [RUN]; without a run, a tiny one is trained first.
"""

import sys
import tempfile
from pathlib import Path

import polars as pl

from racecraft.training.deepracer.plan import RaceRequest
from racecraft.training.progress import LineWatcher
from racecraft.training.worlds import train

with tempfile.TemporaryDirectory() as folder:
    run = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(folder) / "tiny"
    if not run.exists():
        small = ("rollout.num_worlds=8", "rollout.horizon=64", "evaluation.episodes=2", "runtime.threads=1")
        request = RaceRequest(stops=("iterations=2",), run=run, overrides=small)
        train(request, LineWatcher(sys.stdout), print)

    ticks = pl.concat([pl.read_parquet(path) for path in sorted(run.glob("episodes/*.parquet"))])

driven = ticks.filter(pl.col("status") != "prepare")
print(
    driven.group_by("action")
    .agg(pl.len().alias("ticks"), pl.col("reward").mean().round(3), pl.col("velocity_mps").mean().round(2))
    .sort("reward", descending=True)
)
print(ticks.filter(pl.col("done"))["status"].value_counts(sort=True))
