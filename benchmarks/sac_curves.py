"""Learning curves of soft actor-critic: `python benchmarks/sac_curves.py FOLDER [--seeds 3]`.

Each seed is a training as `racecraft gym train ID --algorithm sac` makes it, with the settings that stand in `WORLDS`,
but judged more often. Leaves `sac.json` (every number) and `sac.png` in the folder; `--draw` paints the picture again
from the numbers. Seconds are those of the processor that the process used, so other work on the machine bends them less
than it bends the clock.
"""

from __future__ import annotations

import argparse
import json
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from racecraft.formats.atomic import write_atomic
from racecraft.training.callbacks import IterationReport
from racecraft.training.worlds import train
from racecraft.worlds.gymnasium.training.trainer import GymRequest

WORLDS = {
    "Pendulum-v1": (5_000, -200.0, ()),
    "MountainCarContinuous-v0": (9_000, 90.0, ("sac.noise_correlation=0.95", "sac.gradient_steps_per_step=0.5")),
}
"""Steps of a training, the mean return that counts as learned, and settings that are not the defaults."""
OFTENER = ("evaluation.every=4", "evaluation.episodes=10")


class Noting:
    """Notes (steps, processor seconds, mean return) of each evaluation."""

    def __init__(self) -> None:
        self.points: list[tuple[int, float, float]] = []
        self._began = time.process_time()

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Start the clock."""
        self._began = time.process_time()

    def iteration(self, report: IterationReport) -> None:
        """Note an evaluation."""
        if report.result is not None:
            seconds = time.process_time() - self._began
            self.points.append((report.steps, round(seconds, 2), round(report.result.score, 1)))

    def end(self, reason: str) -> None:
        """Nothing is left to do."""


def curve(world: str, seed: int) -> list[tuple[int, float, float]]:
    """Train once and return what was noted."""
    steps, _, settings = WORLDS[world]
    noting = Noting()
    with tempfile.TemporaryDirectory() as home:
        request = GymRequest(
            world,
            algorithm="sac",
            stops=(f"steps={steps}",),
            run=Path(home) / "run",
            seed=seed,
            overrides=(*OFTENER, *settings),
        )
        train(request, noting, lambda line: None)
    return noting.points


def first_over(points: list[list[float]], goal: float) -> tuple[float, float] | None:
    """Return (steps, seconds) of the first evaluation that reached the goal."""
    return next(((steps, seconds) for steps, seconds, score in points if score >= goal), None)


def draw(curves: dict[str, Any], place: Path) -> None:
    """Paint a panel for each world: every seed thin, their median thick, the goal dashed."""
    figure, panels = plt.subplots(1, len(curves), figsize=(9.6, 3.4), layout="constrained")
    for axes, (world, told) in zip(panels, curves.items(), strict=True):
        scores = [[score for _, _, score in points] for points in told["seeds"].values()]
        steps = [point[0] for point in next(iter(told["seeds"].values()))]
        for one in scores:
            axes.plot(steps, one, color="#7aa6c2", linewidth=0.9)
        axes.plot(steps, [statistics.median(column) for column in zip(*scores, strict=True)], color="#12476b", lw=2.2)
        axes.axhline(told["goal"], color="#b0563b", linestyle="--", linewidth=1)
        axes.annotate(
            f"{told['goal']:g}", (steps[0], told["goal"]), color="#b0563b", va="bottom", fontsize=8,
            xytext=(2, 2), textcoords="offset points",
        )  # fmt: skip
        axes.set_title(f"{world}, {len(scores)} seeds", fontsize=10)
        axes.set_xlabel("environment steps")
        axes.grid(alpha=0.25)
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("mean return of 10 greedy episodes")
    figure.savefig(place, dpi=110)


def main() -> None:
    """Train, note and paint."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--draw", action="store_true", help="only paint again what was measured")
    asked = parser.parse_args()
    numbers = asked.folder / "sac.json"
    if not asked.draw:
        curves: dict[str, Any] = {}
        for world, (_, goal, settings) in WORLDS.items():
            seeds = {str(seed): curve(world, seed) for seed in range(1, asked.seeds + 1)}
            curves[world] = {"goal": goal, "settings": settings, "seeds": seeds}
            write_atomic(numbers, (json.dumps(curves, indent=1) + "\n").encode())
    curves = json.loads(numbers.read_text())
    draw(curves, asked.folder / "sac.png")
    for world, told in curves.items():
        reached = {seed: first_over(points, told["goal"]) for seed, points in told["seeds"].items()}
        print(world, f"first evaluation at {told['goal']:g} or more, (steps, processor seconds) by seed:", reached)


if __name__ == "__main__":
    main()
