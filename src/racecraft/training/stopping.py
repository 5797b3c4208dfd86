"""When a training ends: the first of several stops that holds.

A stop is written as a user types it: `laps`, `minutes=10`, `iterations=50`, `steps=200000`, and for worlds that are
judged by their score or rated, `score=475` or `rating=1600`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from racecraft.contract.errors import SettingError, nearest

KINDS = {
    "laps": "stable: evaluations in a row in which every start brings a full lap",
    "score": "the mean score of an evaluation reaches this much",
    "rating": "the rating of an evaluation reaches this many points (snakes)",
    "minutes": "so many minutes since the first training tick",
    "iterations": "so many iterations, counted from the run's birth",
    "steps": "so many environment steps, counted from the run's birth",
}
"""Every stop, with what it waits for."""


@dataclass(frozen=True)
class Stop:
    """One condition that ends a training."""

    kind: str
    amount: float = 0.0

    def __str__(self) -> str:
        return self.kind if self.kind == "laps" else f"{self.kind}={self.amount:g}"


@dataclass(frozen=True)
class Standing:
    """How far a training has come; what stops look at."""

    seconds: float
    """Since the first training tick of this process, evaluations included."""
    iterations: int
    steps: int
    is_stable: bool
    score: float | None = None
    """Mean score of the latest evaluation."""


def parse_stops(texts: Iterable[str]) -> tuple[Stop, ...]:
    """Read stops as a user types them.

    Raises:
        SettingError: An unknown kind, a missing or a useless amount.

    >>> [str(stop) for stop in parse_stops(["laps", "minutes=1.5"])]
    ['laps', 'minutes=1.5']
    >>> parse_stops(["minuts=3"])
    Traceback (most recent call last):
    racecraft.contract.errors.SettingError: --stop 'minuts=3' is no stop. Did you mean 'minutes'?
    """
    return tuple(_parse(text) for text in texts)


def reached(stops: Iterable[Stop], standing: Standing) -> Stop | None:
    """Return the first stop that holds, or None."""
    return next((stop for stop in stops if _holds(stop, standing)), None)


def _parse(text: str) -> Stop:
    kind, equals, amount = text.strip().partition("=")
    if kind not in KINDS:
        raise SettingError(f"--stop {text!r} is no stop. {nearest(kind, KINDS)}")
    if kind == "laps":
        if equals:
            raise SettingError(
                f"--stop {text!r}: laps takes no amount; evaluation.stable_after says how many in a row."
            )
        return Stop("laps")
    try:
        value = float(amount)
    except ValueError:
        value = float("nan")
    legal = value == value and (kind in ("score", "rating") or 0 < value < float("inf"))
    if not legal or (kind in ("iterations", "steps") and value != int(value)):
        number = "a whole number above 0" if kind in ("iterations", "steps") else "a number above 0"
        raise SettingError(f"--stop {text!r}: expected {number} after '{kind}=', such as {kind}=10.")
    return Stop(kind, value)


def _holds(stop: Stop, standing: Standing) -> bool:
    if stop.kind == "laps":
        return standing.is_stable
    if stop.kind in ("score", "rating"):
        return standing.score is not None and standing.score >= stop.amount
    amounts = {"minutes": standing.seconds / 60.0, "iterations": standing.iterations, "steps": standing.steps}
    return amounts[stop.kind] >= stop.amount
