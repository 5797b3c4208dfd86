"""What the evaluations of a run came to, as a table. Begin with `return_table`, of worlds without one of their own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Row = tuple[object, ...]


@dataclass(frozen=True)
class EvaluationTable:
    """A table of evaluations, the latest first."""

    description: str
    """How was judged, a sentence or two."""
    heads: tuple[str, ...]
    rows: tuple[Row, ...]

    @property
    def numbers(self) -> tuple[int, ...]:
        """Columns that hold numbers: all but the first."""
        return tuple(range(1, len(self.heads)))


def latest_first(evaluations: Sequence[Mapping[str, Any]], mark: str) -> list[Mapping[str, Any]]:
    """Return the evaluations that have a figure of that name, the latest first, of a list by iteration."""
    return [one for one in reversed(evaluations) if mark in one]


def return_table(evaluations: Sequence[Mapping[str, Any]]) -> EvaluationTable | None:
    """Return the table of evaluations by whole episodes; None where no evaluation tells a mean return."""
    evaluations = latest_first(evaluations, "mean_return")
    if not evaluations:
        return None
    rows = (
        (
            one["iteration"], f"{one['mean_return']:.4g}", f"{one['std_return']:.3g}", one["episodes"],
            f"{one['mean_steps']:.1f}",
        )
        for one in evaluations
    )  # fmt: skip
    threshold = next((one["threshold"] for one in evaluations if one.get("threshold") is not None), None)
    solved = "" if threshold is None else f" A mean of {threshold:g} counts as solved."
    return EvaluationTable(
        f"Episodes of the greedy policy.{solved} Latest first.",
        ("iteration", "mean return", "spread (std)", "episodes", "mean steps"),
        tuple(rows),
    )
