"""Read what a training wrote down, tick by tick, with polars: which actions pay, and how episodes end.

Usage: read_episodes.py [RUN]; without a run, a tiny one is trained first.
"""

import sys
import tempfile
from pathlib import Path

import polars as pl

import racecraft as rc

with tempfile.TemporaryDirectory() as folder:
    run = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(folder) / "tiny"
    if not run.exists():
        small = ["rollout.num_worlds=8", "rollout.horizon=64", "evaluation.episodes=2", "runtime.threads=1"]
        rc.train("deepracer", stops="iterations=2", settings=small, run=run)
    ticks = rc.read_run(run).episodes().collect()

driven = ticks.filter(pl.col("status") != "prepare")
print(
    driven.group_by("action")
    .agg(pl.len().alias("ticks"), pl.col("reward").mean().round(3), pl.col("velocity_mps").mean().round(2))
    .sort("reward", descending=True)
)
print(ticks.filter(pl.col("done"))["status"].value_counts(sort=True))
