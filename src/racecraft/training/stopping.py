"""When a training ends: the first of several conditions that holds.

A condition is written as a user types it. Every training knows `minutes=10`, `iterations=50`, `steps=200000`,
`episodes=400` and `reward=55`; what more there is, its evaluator says: `laps` for cars, `score=475` where episodes are
paid, `rating=1600` for snakes.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from racecraft.contract.errors import SettingError, nearest

LAP, GAP = "lap", "gap"
LAPS = {
    "laps": "stable: evaluations in a row in which every start brings a full lap, then three flying laps",
    LAP: "every start of an evaluation brings a full lap, and the fastest flying lap takes at most so many seconds",
    GAP: "the same, at most so many per cent over the best known lap",
}
SCORE = {"score": "the mean score of an evaluation reaches this much"}
RATING = {"rating": "the rating of an evaluation reaches this many points"}
ALWAYS = {
    "minutes": "so many minutes since the first training tick",
    "iterations": "so many iterations, counted from the run's birth",
    "steps": "so many environment steps, counted from the run's birth",
    "episodes": "so many training episodes that ended, counted from the run's birth",
    "reward": "the mean reward of the latest 100 training episodes exceeds this much",
}
"""What every training can end by."""
KINDS = {**LAPS, **SCORE, **RATING, **ALWAYS}
"""Every condition of any world, with what it waits for."""

LATEST_EPISODES = 100
"""Training episodes whose mean reward the stop `reward` looks at; before so many have ended it does not hold."""

BARE = ("laps",)
"""Conditions without an amount: the training is stable."""

_POSITIVE = (lambda amount: 0 < amount < math.inf, "a number above 0")
_WHOLE = (lambda amount: 0 < amount < math.inf and amount == int(amount), "a whole number above 0")
_NUMBER = (math.isfinite, "a number")
_AMOUNTS = {
    **dict.fromkeys(("iterations", "steps", "episodes"), _WHOLE),
    **dict.fromkeys((*SCORE, *RATING, "reward"), _NUMBER),
}
"""What may be asked of each condition, and how a person calls it; others take `_POSITIVE`."""


@dataclass(frozen=True)
class StopCondition:
    """One condition that ends a training."""

    kind: str
    amount: float = 0.0

    def __str__(self) -> str:
        return self.kind if self.kind in BARE else f"{self.kind}={self.amount:.12g}"


@dataclass(frozen=True)
class Progress:
    """How far a training has come; what conditions look at."""

    seconds: float
    """Since the first training tick, evaluations included."""
    iterations: int
    steps: int
    is_stable: bool
    score: float | None = None
    """Mean score of this iteration's evaluation; None without one."""
    lap_seconds: float | None = None
    """Fastest flying lap of this iteration's evaluation where every start brought a full lap; else None."""
    gap_percent: float | None = None
    """How much longer that lap took than the best known one."""
    episodes: int = 0
    """Training episodes that ended."""
    mean_reward: float | None = None
    """Of the latest LATEST_EPISODES training episodes; None before so many have ended."""


def parse_stops(texts: Iterable[str], world: Mapping[str, str] | None = None) -> tuple[StopCondition, ...]:
    """Read conditions as a user types them.

    Args:
        texts: As typed.
        world: What this world's evaluator adds to ALWAYS; None: what any world may.

    Raises:
        SettingError: An unknown kind, one that cannot hold in this world, a missing or a useless amount.

    >>> [str(stop) for stop in parse_stops(["laps", "minutes=1.5"])]
    ['laps', 'minutes=1.5']
    >>> [str(stop) for stop in parse_stops(["lap=8.2", "gap=3%"])]
    ['lap=8.2', 'gap=3']
    >>> [str(stop) for stop in parse_stops(["steps=2400000"])]
    ['steps=2400000']
    >>> parse_stops(["minuts=3"])
    Traceback (most recent call last):
    racecraft.contract.errors.SettingError: --stop 'minuts=3' is no stop. Did you mean 'minutes'?
    >>> parse_stops(["laps"], {})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    racecraft.contract.errors.SettingError: --stop 'laps' can never hold here; expected minutes, iterations, steps...
    """
    known = KINDS if world is None else {**world, **ALWAYS}
    return tuple(_parse(text, known) for text in texts)


def reached(stops: Iterable[StopCondition], progress: Progress) -> StopCondition | None:
    """Return the first condition that holds, or None."""
    return next((stop for stop in stops if _holds(stop, progress)), None)


def share_done(stops: Iterable[StopCondition], progress: Progress) -> float | None:
    """Return what share of a training lies behind, 0 to 1, where steps or else minutes end it; None: none do.

    Steps come first, since a training that goes by the clock is never the same twice.

    >>> share_done(parse_stops(["minutes=4", "steps=1000"]), Progress(60.0, 1, 500, False))
    0.5
    >>> share_done(parse_stops(["laps", "minutes=4"]), Progress(60.0, 1, 500, False))
    0.25
    """
    for kind, so_far in (("steps", progress.steps), ("minutes", progress.seconds / 60.0)):
        if limits := [stop.amount for stop in stops if stop.kind == kind]:
            return min(1.0, so_far / min(limits))
    return None


def _parse(text: str, known: Mapping[str, str]) -> StopCondition:
    kind, equals, amount = text.strip().partition("=")
    if kind not in KINDS:
        raise SettingError("--stop {text!r} is no stop. {hint}", text=text, hint=nearest(kind, known))
    if kind not in known:
        raise SettingError("--stop {text!r} can never hold here; expected {known}.", text=text, known=", ".join(known))
    if kind in BARE:
        if equals:
            raise SettingError(
                "--stop {text!r}: {kind} takes no amount; evaluation.stable_after says how many in a row.",
                text=text,
                kind=kind,
            )
        return StopCondition(kind)
    try:
        value = float(amount.removesuffix("%") if kind == GAP else amount)
    except ValueError:
        value = float("nan")
    is_legal, number = _AMOUNTS.get(kind, _POSITIVE)
    if not is_legal(value):
        raise SettingError(
            "--stop {text!r}: expected {number} after '{kind}=', such as {kind}=10.",
            text=text,
            number=number,
            kind=kind,
        )
    return StopCondition(kind, value)


def _holds(stop: StopCondition, progress: Progress) -> bool:
    if stop.kind in BARE:
        return progress.is_stable
    if stop.kind in (*SCORE, *RATING):
        return progress.score is not None and progress.score >= stop.amount
    if stop.kind in (LAP, GAP):
        reached_so_far = progress.lap_seconds if stop.kind == LAP else progress.gap_percent
        return reached_so_far is not None and reached_so_far <= stop.amount
    if stop.kind == "reward":
        return progress.mean_reward is not None and progress.mean_reward > stop.amount
    if stop.kind == "minutes":
        return progress.seconds / 60.0 >= stop.amount
    counts = {"iterations": progress.iterations, "steps": progress.steps, "episodes": progress.episodes}
    return counts[stop.kind] >= stop.amount
