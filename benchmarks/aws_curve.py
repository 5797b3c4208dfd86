"""The learning curve of `--preset aws` beside the curves of real trainings: `python benchmarks/aws_curve.py`.

Five seeds of the settings that the 2022 logs were made with: 14 actions, car v4, re:Invent 2018, centre-line reward,
gamma 0.95, 3 epochs, 20 episodes an iteration, start advancing 5 % of the lap. It takes a quarter of an hour on two
cores; nothing else should run meanwhile. Leaves `aws-curve.md` and `aws-curve.png` in the folder it is told. The real
curves are read from the reference data beside the checkout and left out where that is absent.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
from dataclasses import dataclass
from itertools import groupby, pairwise
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from racecraft.formats.atomic import write_atomic
from racecraft.training.progress import LineWatcher
from racecraft.training.worlds import train as train_run
from racecraft.worlds.deepracer.files.training_metrics import TrainingRow, read_metrics_file
from racecraft.worlds.deepracer.training.plan import RaceRequest

HYPERPARAMETERS = {
    "batch_size": 64, "beta_entropy": 0.01, "discount_factor": 0.95, "exploration_type": "categorical",
    "loss_type": "huber", "lr": 0.0003, "num_episodes_between_training": 20, "num_epochs": 3,
}  # fmt: skip
METADATA = {
    "action_space": [
        {"steering_angle": angle, "speed": speed} for angle in (-30, -20, -10, 0, 10, 20, 30) for speed in (1.0, 2.0)
    ],
    "sensor": ["FRONT_FACING_CAMERA"],
    "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    "version": "4",
}
"""As in the logs of 2022 (facts 10.3)."""
ENOUGH = 95.0
"""Mean progress of an evaluation, per cent, that three in a row must average."""
EXPECTED = range(15, 31)
"""Iterations in which the median seed is expected to reach it."""
LOGS = {
    "AWS console 2022": "console-2022/metrics/training/training-*.json",
    "DeepRacer for Cloud 2022": "drfc-1-worker/metrics/TrainingMetrics.json",
}
TRACES = Path(__file__).resolve().parents[2] / "shared" / "data" / "traces"


@dataclass(frozen=True)
class Curve:
    """A training: mean progress of each iteration, per cent."""

    name: str
    training: list[float]
    evaluation: list[float]
    """After as many iterations as its place says, from 1."""
    steps: int | None = None
    seconds: float | None = None

    @property
    def reached(self) -> int | None:
        """First of three evaluations in a row that average ENOUGH; None where there is none."""
        triples = zip(self.evaluation, self.evaluation[1:], self.evaluation[2:], strict=False)
        return next((i for i, triple in enumerate(triples, 1) if statistics.mean(triple) >= ENOUGH), None)


def train(seed: int, iterations: int, overrides: tuple[str, ...] = ()) -> Curve:
    """Train one seed and return its curve."""
    with tempfile.TemporaryDirectory() as place:
        folder, run = Path(place) / "car", Path(place) / "run"
        folder.mkdir()
        (folder / "hyperparameters.json").write_text(json.dumps(HYPERPARAMETERS), encoding="utf-8")
        (folder / "model_metadata.json").write_text(json.dumps(METADATA), encoding="utf-8")
        request = RaceRequest(
            folder=folder, track="reinvent_base", preset="aws", stops=(f"iterations={iterations}",), run=run,
            seed=seed, overrides=overrides,
        )  # fmt: skip
        trained = train_run(request, LineWatcher(sys.stdout), print)
        rows = [json.loads(line) for line in trained.run.metrics.read_text(encoding="utf-8").splitlines()]
    return Curve(
        f"seed {seed}",
        [row["training_score"] for row in rows],
        [row["evaluation_score"] for row in rows],
        trained.outcome.steps,
        trained.outcome.seconds,
    )


def real_curves() -> list[Curve]:
    """Return the curves of the real trainings, as far as their metrics lie beside the checkout."""
    return [real_curve(name, path) for name, pattern in LOGS.items() for path in sorted(TRACES.glob(pattern))]


def real_curve(name: str, path: Path) -> Curve:
    """Return the curve of a metrics file: blocks of training episodes with blocks of evaluation after them."""
    rows = [row for row in read_metrics_file(path).rows if isinstance(row, TrainingRow)]
    blocks = [
        (phase, statistics.mean(row.completion_percentage for row in block))
        for phase, block in groupby(rows, key=lambda row: row.phase)
    ]
    training = [mean for phase, mean in blocks if phase == "training"]
    after = [mean for (before, _), (phase, mean) in pairwise(blocks) if (before, phase) == ("training", "evaluation")]
    return Curve(name, training, after)


def draw(curves: list[Curve], real: list[Curve], path: Path) -> None:
    """Draw training and evaluation progress by iteration, ours in colour, the real ones dark."""
    figure, panels = plt.subplots(2, 1, figsize=(9, 7), sharex=True, layout="constrained")
    for panel, kind in zip(panels, ("training", "evaluation"), strict=True):
        for curve, style in zip(real, ("-", "--"), strict=False):
            values = getattr(curve, kind)
            panel.plot(range(1, len(values) + 1), values, style, color="black", linewidth=2.2, label=curve.name)
        for curve in curves:
            values = getattr(curve, kind)
            panel.plot(range(1, len(values) + 1), values, linewidth=1.1, alpha=0.85, label=f"racecraft, {curve.name}")
        panel.set_ylabel(f"{kind}: mean progress, % of the lap")
        panel.set_ylim(0, 103)
        panel.grid(alpha=0.25)
    panels[0].set_title("re:Invent 2018, settings of the 2022 logs: --preset aws beside real trainings")
    panels[1].set_xlabel("iteration (20 episodes each)")
    panels[0].legend(fontsize=8)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def table(curves: list[Curve], real: list[Curve]) -> str:
    """Return what was measured, as a Markdown page."""
    lines = [
        "# The learning curve of `--preset aws`",
        "",
        f"*Reached*: first of three evaluations in a row that average {ENOUGH:g} % of the lap. Settings of the 2022 "
        "logs (14 actions, car v4, centre-line reward, gamma 0.95, 3 epochs, 20 episodes); re:Invent 2018.",
        "",
        "| training | reached at iteration | iterations | steps | steps/s, evaluation and files in |",
        "|---|---|---|---|---|",
    ]
    for curve in (*real, *curves):
        speed = f"{curve.steps / curve.seconds:.0f}" if curve.steps and curve.seconds else ""
        steps = f"{curve.steps:,}" if curve.steps else ""
        lines.append(f"| {curve.name} | {curve.reached or 'not'} | {len(curve.training)} | {steps} | {speed} |")
    middle = median_reached(curves)
    lines += ["", f"Median of {len(curves)} seeds: {'not reached' if middle is None else f'{middle:g}'}. "
              f"Expected: {EXPECTED.start} to {EXPECTED.stop - 1}.", "", "![curves](aws-curve.png)", ""]  # fmt: skip
    return "\n".join(lines)


def median_reached(curves: list[Curve]) -> float | None:
    """Return the median iteration; a seed that did not get there counts as never, None where the median is never."""
    middle = statistics.median(float("inf") if curve.reached is None else curve.reached for curve in curves)
    return None if middle == float("inf") else middle


def main(arguments: list[str] | None = None) -> list[Curve]:
    """Train, write table and picture, return the curves."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--iterations", type=int, default=35)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    parser.add_argument("--set", action="append", default=[], help="a setting, such as ppo.precision=bfloat16")
    asked = parser.parse_args(arguments)
    real = real_curves()
    curves: list[Curve] = []
    for seed in range(1, asked.seeds + 1):
        curves.append(train(seed, asked.iterations, tuple(asked.set)))
        write_atomic(asked.out / "aws-curve.md", table(curves, real))
        draw(curves, real, asked.out / "aws-curve.png")
    print(table(curves, real))
    return curves


if __name__ == "__main__":
    main()
