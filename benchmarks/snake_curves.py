"""How a snake's rating grows while it trains: three seeds of `racecraft snakes train` in duels on 11x11.

    python benchmarks/snake_curves.py FOLDER           train (each seed some minutes of a core), keep, draw
    python benchmarks/snake_curves.py FOLDER --draw    draw again what was kept

Each run takes the same number of steps, on one thread; a run that stands in FOLDER is gone on with, or taken as it is.
The rating is the training's own, of its greedy policy against the anchors, whose mean is 1500. Writes
benchmarks/snake_curves.json and docs/pictures/snake-curves.png, and prints the table of docs/battlesnake/learning.md.
Steps count and not seconds, so a machine that does other things meanwhile bends nothing but the column of seconds.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "snake_curves.json"
PICTURE = HERE.parent / "docs" / "pictures" / "snake-curves.png"
SEEDS, STEPS = (1, 2, 3), 1_250_000
MILESTONES = (1600, 1800, 1900)
"""Elo points; a player 200 above another wins three games of four."""
COLOURS = ("#1b6ca8", "#d1622b", "#3f8f5f")


def train(run: Path, seed: int) -> None:
    """Train one snake, or go on where its run stands."""
    words = [sys.executable, "-m", "racecraft", "snakes", "train", "--run", str(run), "--stop", f"steps={STEPS}"]
    if (run / "job.json").exists():
        words += ["--resume"]
    else:
        words += ["--size", "11", "--snakes", "2", "--seed", str(seed), "--set", "runtime.threads=1"]
    subprocess.run([*words, "--no-pictures"], check=True)


def curve_of(run: Path) -> list[list[float]]:
    """Return steps, seconds of training and rating of every evaluation."""
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text("utf-8").splitlines()]
    kept = [row for row in rows if row["evaluation_score"] is not None]
    return [[row["steps"], round(row["seconds"], 1), round(row["evaluation_score"], 1)] for row in kept]


def table(curves: dict[str, list[list[float]]]) -> str:
    """Return when each seed had so many points for good, and what it ended with, as Markdown."""
    lines = ["| seed | " + " | ".join(f"{points} points, steps" for points in MILESTONES) + " | at the end |"]
    lines.append("|---" * (len(MILESTONES) + 2) + "|")
    for seed, curve in curves.items():
        reached = [next((f"{at:,.0f}" for at, _, rating in curve if rating >= points), "-") for points in MILESTONES]
        end = statistics.fmean(rating for *_, rating in curve[-3:])
        lines.append(f"| {seed} | {' | '.join(reached)} | {end:,.0f} |")
    return "\n".join(lines)


def draw(curves: dict[str, list[list[float]]]) -> None:
    """Draw every evaluation."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axis = plt.subplots(figsize=(7.5, 3.8), dpi=110)
    for (seed, curve), colour in zip(curves.items(), COLOURS, strict=False):
        steps, ratings = [at / 1e6 for at, *_ in curve], [rating for *_, rating in curve]
        axis.plot(steps, ratings, "o-", color=colour, lw=1.6, ms=3.5, label=f"seed {seed}")
    axis.axhline(1500, color="#777777", lw=0.8, ls=":")
    axis.annotate("mean of the anchors", (0.99, 1505), xycoords=("axes fraction", "data"), ha="right", va="bottom")
    axis.set_xlim(left=0.0)
    axis.set_xlabel("million steps")
    axis.set_ylabel("rating, Elo points")
    axis.legend(frameon=False, loc="upper left")
    axis.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    figure.savefig(PICTURE)


def main() -> None:
    """Train, keep, draw, print."""
    options = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--draw", action="store_true")
    asked = options.parse_args()
    if not asked.draw:
        for seed in SEEDS:
            train(asked.folder / f"snake{seed}", seed)
        curves = {str(seed): curve_of(asked.folder / f"snake{seed}") for seed in SEEDS}
        RESULTS.write_text(json.dumps({"steps": STEPS, "curves": curves}) + "\n", encoding="utf-8")
    curves = json.loads(RESULTS.read_text("utf-8"))["curves"]
    draw(curves)
    print(table(curves))


if __name__ == "__main__":
    main()
