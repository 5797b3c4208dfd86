"""Compare runs as groups of seeds: which is better, how sure that is, and what differs."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option


@dataclass(frozen=True, kw_only=True)
class CompareRequest(Request):
    """Which runs are compared."""

    runs: tuple[str, ...] = argument(
        "RUN[:best|last|N], folders of `train --seeds`, or models of AWS. Runs with the same settings are one group.",
        metavar="RUN…",
    )
    starts: int = option(20, "Fresh starts from which each checkpoint is judged.", low=1, high=1000)
    page: Path | None = option(None, "Write one page (.html) that works offline.")


@dataclass(frozen=True)
class ComparedSeed:
    """One run of a group."""

    run: str
    checkpoint: int
    score: float | None
    """Of times the median over the fresh starts, None where most reached no goal; of returns the mean."""
    reached_share: float
    progress: float
    values: list[float | None]
    """One a start."""


@dataclass(frozen=True)
class ComparedGroup:
    """A group of seeds."""

    name: str
    seeds: list[ComparedSeed]
    mean: float | None
    """Interquartile mean of the seeds."""
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Comparison:
    """What a comparison came to; groups stand in the order they were given."""

    measure: str
    """What scores are: "lap time, s"."""
    less_is_better: bool
    groups: list[ComparedGroup]
    order: list[int]
    """The groups, the best first."""
    verdict: list[str]
    is_clear: bool
    probability: float | None
    """That a seed of the best group beats one of the next; None of one group."""
    probability_low: float | None
    probability_high: float | None
    luck: float | None
    """How often luck alone makes such a difference."""
    differences: list[dict[str, Any]]
    """Settings that differ: `name`, and `values` in the order of the groups."""
    page: str | None
    """Where the page was written."""


@action
def compare(request: CompareRequest, progress: Progress = quiet) -> Comparison:
    """Tell whether one training is better than another, or luck.

    Every run's best checkpoint is judged anew from fresh starts, which did not choose it. Runs with the same settings
    are seeds of one group. A verdict says no more than its seeds allow.

    Examples:
        racecraft compare runs/speed-1 runs/speed-2 runs/speed-3 runs/centre-1 runs/centre-2 runs/centre-3

        racecraft compare runs/speed-seeds runs/centre-seeds --page compare.html

        racecraft compare runs/reinvent_base-1 runs/reinvent_base-1:last --starts 100

    Raises:
        UserInputError: A run cannot be used, or the runs cannot be compared.
    """
    from racecraft.analysis.compare_page import Compared, write_compare_page
    from racecraft.evaluation.fresh_starts import score_on_fresh_starts
    from racecraft.evaluation.run_groups import differences, group_runs
    from racecraft.evaluation.verdict import ScoredGroup, verdict_of

    groups = group_runs(request.runs)
    differing = differences(groups)
    scored = []
    total, done = sum(len(group.runs) for group in groups), 0
    with progress.counting("runs") as count:
        for group in groups:
            scores = []
            for one in group.runs:
                scores.append(score_on_fresh_starts(one.run, one.which, request.starts))
                done += 1
                count(done, total)
            scored.append(ScoredGroup(group.name, tuple(scores)))
    verdict = verdict_of(scored, differing)
    if request.page is not None:
        write_compare_page(request.page, Compared(groups, scored, verdict, differing))
    comparison = verdict.comparison
    seeds = [
        [
            ComparedSeed(
                str(one.run.path), scores.checkpoint, finite(scores.score), scores.reached_share, scores.fallback,
                [finite(value) for value in scores.values],
            )
            for one, scores in zip(group.runs, of.scores, strict=True)
        ]
        for group, of in zip(groups, scored, strict=True)
    ]  # fmt: skip
    return Comparison(
        measure=verdict.measure.name + (f",{verdict.measure.unit}" if verdict.measure.unit else ""),
        less_is_better=verdict.measure.less_is_better,
        groups=[
            ComparedGroup(group.name, runs, finite(mean.value), mean.low, mean.high)
            for group, runs, mean in zip(groups, seeds, verdict.means, strict=True)
        ],
        order=list(verdict.order),
        verdict=list(verdict.sentences),
        is_clear=verdict.is_clear,
        probability=None if comparison is None else comparison.probability.value,
        probability_low=None if comparison is None else comparison.probability.low,
        probability_high=None if comparison is None else comparison.probability.high,
        luck=None if comparison is None else comparison.luck,
        differences=[asdict(one) for one in differing],
        page=None if request.page is None else str(request.page),
    )


def finite(value: float) -> float | None:
    """Return a number, or None for one that JSON has no word for."""
    return value if abs(value) < float("inf") else None
