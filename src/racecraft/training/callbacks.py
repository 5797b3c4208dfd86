"""What a training tells those who watch it; watching is a callback, never a flag."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from racecraft.formats.run_folder import RunFolder


@dataclass(frozen=True)
class EndedAlike:
    """Episodes that ended in the same way, in a few figures; None: nobody knows."""

    episodes: int
    mean_reward: float | None
    """Mean sum of rewards."""
    mean_score: float | None
    mean_seconds: float | None
    """Mean simulated time that they took."""


def ended_alike(episodes: Iterable[tuple[str, float | None, float | None, float | None]]) -> dict[str, EndedAlike]:
    """Return how episodes went, by the word for how they ended; they are given as (word, reward, score, seconds).

    >>> ended_alike([("off_track", 2.0, 10.0, 1.5), ("off_track", 4.0, 20.0, 2.5)])
    {'off_track': EndedAlike(episodes=2, mean_reward=3.0, mean_score=15.0, mean_seconds=2.0)}
    """
    groups: dict[str, list[tuple[float | None, ...]]] = {}
    for word, *figures in episodes:
        groups.setdefault(word, []).append(tuple(figures))
    return {word: EndedAlike(len(group), *map(_mean, zip(*group, strict=True))) for word, group in groups.items()}


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


@dataclass(frozen=True)
class EvaluationResult:
    """What an evaluation of the greedy policy came to."""

    score: float
    """Bigger is better: mean progress in per cent for cars, mean return or rating for other worlds."""
    solved: bool
    """Every episode met the world's goal, or the mean its threshold."""
    goal_reached: bool = False
    """At least one episode met the goal."""
    figures: Mapping[str, float | None] = field(default_factory=dict)
    """The world's own measures by name with their unit ("best_lap_seconds"); columns of metrics.jsonl."""
    headline: str = ""
    """The most telling of them in a few words ("best lap 8.31 s"); may be empty."""
    details: dict[str, Any] = field(default_factory=dict)
    """Everything else, as plain values for evaluations/N.json."""
    selection: tuple[float, ...] = ()
    """What makes a checkpoint the best, compared from the first number on, bigger is better; empty: the score."""
    luck: float = 0.0
    """Share of that first number by which evaluations of one policy differ by chance."""
    steps: int = 0
    """Steps of agents that were taken for it; 0 where it looked at the training's own."""
    write_files: Callable[[RunFolder, int], None] = field(default=lambda run, iteration: None, compare=False)
    """Writes what else of it belongs in the run folder; is given the iteration."""
    by_status: Mapping[str, EndedAlike] = field(default_factory=dict)
    """Its episodes by the world's word for how they ended; empty where the world tells of them otherwise."""

    @property
    def selection_metric(self) -> tuple[float, ...]:
        """What checkpoints are compared by."""
        return self.selection or (self.score,)

    def takes_the_place_of(self, best: EvaluationResult) -> bool:
        """Tell whether this result is the best now; of results that are equal, but for luck, the newer is.

        The best of many evaluations was lucky; the newest policy has learned longest.

        >>> slower = EvaluationResult(100.0, True, selection=(-6400.0,), luck=0.03)
        >>> slower.takes_the_place_of(EvaluationResult(100.0, True, selection=(-6300.0,)))
        True
        >>> slower.takes_the_place_of(EvaluationResult(100.0, True, selection=(-6200.0,)))
        False
        """
        own, other = self.selection_metric, best.selection_metric
        return own >= other or (self.luck > 0.0 and own[0] >= other[0] - self.luck * abs(other[0]))


@dataclass(frozen=True)
class IterationReport:
    """One turn of the loop: collect, update, evaluate, write."""

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
    mean_reward: float | None
    """Mean sum of rewards of those episodes; None without any."""
    training_score: float | None
    """Mean score of those that have one; None without any."""
    losses: Mapping[str, float]
    """The learner's figures, by name."""
    result: EvaluationResult | None
    """None in an iteration without an evaluation."""
    is_best: bool
    """The result is the best so far."""
    by_status: Mapping[str, EndedAlike] = field(default_factory=dict)
    """Those episodes by the world's word for how they ended."""
    phase_seconds: Mapping[str, float] = field(default_factory=dict)
    """Where the time went: "collect", "learn", "judge", and "keep_before", what writing the iteration before took."""


class TrainingCallback(Protocol):
    """Somebody who watches a training, iteration by iteration."""

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Training is about to take its first tick; the score is called `score_name` ("progress %", "return")."""
        ...

    def iteration(self, report: IterationReport) -> None:
        """One iteration was written down."""
        ...

    def end(self, reason: str) -> None:
        """Training is over, and why."""
        ...


@runtime_checkable
class RunPathCallback(Protocol):
    """A callback that wants to know where the run lies, before the training begins."""

    def run_made(self, path: Path) -> None:
        """The run folder stands."""
        ...


class NullCallback:
    """Watches and says nothing."""

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Nothing to say."""

    def iteration(self, report: IterationReport) -> None:
        """Nothing to say."""

    def end(self, reason: str) -> None:
        """Nothing to say."""


class Callbacks:
    """Several that watch, told in their order.

    Args:
        watching: Who watches.
    """

    def __init__(self, *watching: TrainingCallback) -> None:
        self._watching = watching

    def run_made(self, path: Path) -> None:
        """Tell those that want to know."""
        for one in self._watching:
            if isinstance(one, RunPathCallback):
                one.run_made(path)

    def begin(self, title: str, stops: str, score_name: str) -> None:
        """Tell all of them."""
        for one in self._watching:
            one.begin(title, stops, score_name)

    def iteration(self, report: IterationReport) -> None:
        """Tell all of them."""
        for one in self._watching:
            one.iteration(report)

    def end(self, reason: str) -> None:
        """Tell all of them."""
        for one in self._watching:
            one.end(reason)
