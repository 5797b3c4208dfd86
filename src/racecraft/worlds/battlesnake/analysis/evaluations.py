"""What the evaluations of a snake's run came to, as a table of ratings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from racecraft.analysis.evaluations import EvaluationTable, latest_first


def rating_table(evaluations: Sequence[Mapping[str, Any]]) -> EvaluationTable | None:
    """Return the table of a run's ratings; None where no evaluation tells one."""
    evaluations = latest_first(evaluations, "rating")
    if not evaluations:
        return None
    rivals = tuple(evaluations[0].get("against", {}))
    rows = (
        (
            one["iteration"], f"{one['rating']:.0f}", f"{one['rating_low']:.0f} to {one['rating_high']:.0f}",
            *(_won(one.get("against", {}).get(rival)) for rival in rivals),
        )
        for one in evaluations
    )  # fmt: skip
    return EvaluationTable(
        "The greedy policy plays the built-in players; what it won of the games against each makes its rating, with "
        "the interval that holds it 95 times of 100. Latest first.",
        ("iteration", "rating (Elo)", "95 %", *(f"won against {rival}" for rival in rivals)),
        tuple(rows),
    )


def _won(result: Mapping[str, Any] | None) -> str:
    return "–" if result is None else f"{result['won']} of {result['games']}"
