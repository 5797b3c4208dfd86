"""What a training tells those who watch it; watching is an observer, never a flag."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol


@dataclass(frozen=True)
class Verdict:
    """What a judgement of the greedy policy came to."""

    score: float
    """Bigger is better: mean progress in per cent for cars, mean return for other worlds."""
    is_perfect: bool
    """Every start brought a full lap (cars); the judged world's own threshold was met (others)."""
    best_lap_seconds: float | None = None
    details: dict[str, Any] = field(default_factory=dict)
    """Everything else, as plain values for evaluations/N.json."""
    merit: float | None = None
    """What makes a checkpoint the best, bigger is better; None: the score."""


@dataclass(frozen=True)
class IterationReport:
    """One turn of the loop: collect, learn, judge, keep."""

    iteration: int
    """Counted from 1 and from the run's birth."""
    steps: int
    """Environment steps since the run's birth."""
    seconds: float
    """Since the first training tick, evaluations in, compilation out."""
    steps_per_second: float
    """Of this iteration, everything in."""
    episodes: int
    """Training episodes that ended in this iteration."""
    training_score: float | None
    """Mean score of those episodes; None without any."""
    losses: dict[str, float]
    """The learner's figures, by name."""
    verdict: Verdict | None
    """None in an iteration without an evaluation."""
    is_best: bool
    """The verdict is the best so far."""
    phase_seconds: dict[str, float] = field(default_factory=dict)
    """Where the time went: "collect", "learn", "judge", and "keep_before", what keeping the iteration before took."""


class Listener(Protocol):
    """Somebody who watches a training."""

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Training is about to take its first tick; the score is called `score_name` ("progress %", "return")."""
        ...

    def iteration(self, report: IterationReport) -> None:
        """One iteration was kept."""
        ...

    def end(self, reason: str) -> None:
        """Training is over, and why."""
        ...
