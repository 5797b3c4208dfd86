"""Curves of a training as TensorBoard reads them, under the names of ML-Agents. Begin with `TensorBoard`.

    Environment/Cumulative Reward             mean return of the training episodes that ended
    Losses/Policy Loss, Losses/Value Loss     of the last update
    Policy/Entropy                            in nats
    Learner/…                                 whatever else the learner tells, by its own names
    Evaluation/…                              the greedy policy's score and figures
    Time/Steps per Second                     of the whole iteration

The horizontal axis is environment steps. `--set runtime.tensorboard=true` asks for it, whatever is trained.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from racecraft.contract.errors import MissingExtraError
from racecraft.training.callbacks import IterationReport

FOLDER = "tensorboard"
"""In the run folder."""
NAMES = {
    "policy_loss": "Losses/Policy Loss",
    "value_loss": "Losses/Value Loss",
    "entropy": "Policy/Entropy",
}
"""What ML-Agents calls a learner's figures."""


class TensorBoard:
    """Writes what a training tells into a folder that `tensorboard --logdir` reads.

    A run that goes on writes a further file there; what the first one holds from that step on is left out by
    TensorBoard.

    Args:
        folder: Where; made when the first iteration is over.

    Raises:
        MissingExtraError: tensorboard is not installed.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._open = folder, summary_writer()
        self._writer: Any = None
        self._score_name, self._iteration = "score", 0

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Learn what the score is called."""
        self._score_name = score_name

    def iteration(self, report: IterationReport) -> None:
        """Write an iteration's points; of one that is told again, only its evaluation."""
        if self._writer is None:
            self._writer = self._open(str(self._folder), purge_step=report.steps)
        points = [] if report.iteration == self._iteration else list(training_points(report))
        for name, value in [*points, *evaluation_points(report, self._score_name)]:
            self._writer.add_scalar(name, value, report.steps)
        self._writer.flush()
        self._iteration = report.iteration

    def end(self, reason: str) -> None:
        """Close the file."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None


def training_points(report: IterationReport) -> Iterator[tuple[str, float]]:
    """Yield name and value of what was learned in an iteration.

    >>> report = IterationReport(1, 64, 1.0, 64.0, 0, None, None, {"entropy": 0.5, "clip_fraction": 0.1}, None, False)
    >>> list(training_points(report))
    [('Policy/Entropy', 0.5), ('Learner/clip_fraction', 0.1), ('Time/Steps per Second', 64.0)]
    """
    if report.mean_reward is not None:
        yield "Environment/Cumulative Reward", report.mean_reward
    for name, value in report.losses.items():
        yield NAMES.get(name, f"Learner/{name}"), value
    yield "Time/Steps per Second", report.steps_per_second


def evaluation_points(report: IterationReport, score_name: str) -> Iterator[tuple[str, float]]:
    """Yield name and value of what the greedy policy came to, where it was judged."""
    if report.result is not None:
        yield f"Evaluation/{score_name}", report.result.score
        for name, value in report.result.figures.items():
            if value is not None:
                yield f"Evaluation/{name}", value


def summary_writer() -> Any:
    """Return the class that writes.

    Raises:
        MissingExtraError: tensorboard is not installed.
    """
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError as cause:
        raise MissingExtraError(
            "runtime.tensorboard needs the package 'tensorboard', which is not installed. pip install tensorboard"
        ) from cause
    return SummaryWriter
