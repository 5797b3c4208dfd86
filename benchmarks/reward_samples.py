"""What a car learns from each sample reward: curve, flying lap and share finished, over several seeds.

    python benchmarks/reward_samples.py OUT.json [--only NAME …] [--seeds 3] [--steps 60000]
    python benchmarks/reward_samples.py OUT.json --table
    python benchmarks/reward_samples.py OUT.json --picture ../docs/pictures/reward-samples.png

Every sample trains on re:Invent 2018 with the car and settings of `racecraft new`, in one thread; samples for objects
train among boxes, those for cars behind bots. Curve and judging are those of `racing.py`. A finished row stays in
OUT.json, and a second call does the rest.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

from racecraft.analysis.plot import sheet
from racecraft.pages.colours import BLUE, ORANGE, QUIET
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.driving.reward.check import check_reward
from racecraft.worlds.deepracer.files.reward_samples import FOLDER, read_sample, sample_names
from racecraft.worlds.deepracer.training.new_model import new_model
from racecraft.worlds.deepracer.training.plan import RaceRequest
from racing import Curve, judged

COLUMNS = 5
"""Of the picture."""
RACES = {"free_lane": "OBJECT_AVOIDANCE", "pass_cars": "HEAD_TO_BOT"}
"""The race of a sample that is no time trial."""


def main() -> None:
    """Train and judge what OUT.json lacks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--only", nargs="*", default=sample_names())
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--steps", type=int, default=60_000)
    parser.add_argument("--table", action="store_true", help="Train nothing; print OUT.json as a Markdown table.")
    parser.add_argument("--picture", type=Path, help="Train nothing; draw OUT.json's curves into this PNG.")
    asked = parser.parse_args()
    rows = json.loads(asked.out.read_text())["rows"] if asked.out.is_file() else []
    if asked.table:
        print_table(rows)
        return
    if asked.picture is not None:
        draw_curves(rows, asked.picture)
        return
    for seed in range(1, asked.seeds + 1):
        for name in asked.only:
            if any((row["sample"], row["seed"], row["steps"]) == (name, seed, asked.steps) for row in rows):
                continue
            rows.append({"sample": name, "seed": seed, "steps": asked.steps, **trained(name, seed, asked.steps)})
            asked.out.write_text(json.dumps({"rows": rows}, indent=1))
            print({key: value for key, value in rows[-1].items() if key != "curve"}, flush=True)


def trained(name: str, seed: int, steps: int) -> dict[str, Any]:
    """Train a car with a sample and judge it; return what came of it."""
    with tempfile.TemporaryDirectory() as kept:
        folder, curve = Path(kept) / "car", Curve()
        new_model(folder)
        (folder / "reward_function.py").write_text(read_sample(name), encoding="utf-8")
        overrides = ["runtime.threads=1", f"race.type={RACES.get(name, 'TIME_TRIAL')}"]
        request = RaceRequest(
            folder, run=Path(kept) / "run", seed=seed, stops=(f"steps={steps}",), overrides=tuple(overrides)
        )
        run = train(request, curve, lambda text: None).run
        return {**judged(run.path), "curve": curve.rows}


def print_table(rows: list[dict[str, Any]]) -> None:
    """Print what the check says of each sample, and what its seeds came to, in the order of seeds."""
    print("| sample | teaches | finished | flying lap, s | steering, °/s |\n|---|---|---|---|---|")
    for name in sample_names():
        seeds = sorted((row for row in rows if row["sample"] == name), key=lambda row: row["seed"])
        verdict = check_reward(FOLDER / f"{name}.py").speed
        laps = [row["median_flying_lap_seconds"] for row in seeds]
        cells = (
            ", ".join(f"{100 * row['finished_share']:.0f} %" for row in seeds) or "–",
            ", ".join("–" if lap is None else f"{lap:.2f}" for lap in laps) or "–",
            ", ".join(f"{row['steering_change_degrees_per_second']:.0f}" for row in seeds) or "–",
        )
        print(f"| {name} | {'–' if verdict is None else verdict.teaches} | {' | '.join(cells)} |")


def draw_curves(rows: list[dict[str, Any]], path: Path) -> None:
    """Draw of each sample the median lap of the judged starts over steps, a line a seed; hollow where not all lap."""
    names = sample_names()
    figure, axes = sheet(-(-len(names) // COLUMNS), COLUMNS, names, (2.6, 1.9))
    for name, one in zip(names, axes, strict=True):
        for row, colour in zip((row for row in rows if row["sample"] == name), (BLUE, ORANGE, QUIET), strict=False):
            laps = [point for point in row["curve"] if point["median_lap_seconds"] is not None]
            steps = [point["steps"] / 1000 for point in laps]
            one.plot(steps, [point["median_lap_seconds"] for point in laps], color=colour, lw=1.2)
            some = [point for point in laps if point["full_share"] < 1]
            one.scatter(
                [point["steps"] / 1000 for point in some], [point["median_lap_seconds"] for point in some], s=9,
                facecolor="white", edgecolor=colour, linewidth=0.8, zorder=3,
            )  # fmt: skip
        one.set(xlim=(0, 62), ylim=(5.5, 14.5))
    figure.supxlabel("1,000 steps", fontsize=10)
    figure.supylabel("median lap of the judged starts (s)", fontsize=10)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
