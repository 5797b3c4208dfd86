"""What the evaluations of a run came to, as a table: laps of cars, ratings of snakes, returns of all others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from racecraft.analysis.page import Bar
from racecraft.worlds.deepracer.files.generalisation import HELD_OUT, TRAINED, TrackResult

Row = tuple[object, ...]


@dataclass(frozen=True)
class Judged:
    """A table of evaluations, the latest first."""

    words: str
    """How was judged, a sentence or two."""
    heads: tuple[str, ...]
    rows: tuple[Row, ...]

    @property
    def numbers(self) -> tuple[int, ...]:
        """Columns that hold numbers: all but the first."""
        return tuple(range(1, len(self.heads)))


def judged(evaluations: Sequence[Mapping[str, Any]]) -> Judged | None:
    """Return the table of evaluations as a run's folder has them, by iteration; None where there is none to show."""
    latest_first = list(reversed(evaluations))
    for mark, table in (("laps", _laps), ("rating", _ratings), ("mean_return", _returns)):
        marked = [one for one in latest_first if mark in one]
        if marked:
            return table(marked)
    return None


def judged_by_track(told: tuple[int, Sequence[TrackResult]] | None) -> Judged | None:
    """Return how one policy drives on several tracks, the worst first; None where there is one track."""
    if told is None:
        return None
    iteration, results = told
    parts = []
    for role, words in ((TRAINED, "trained on"), (HELD_OUT, "never seen in training")):
        part = [one for one in results if one.role == role]
        if part:
            progress = sum(one.mean_progress_percent for one in part) / len(part)
            lapped = sum(one.is_lapped for one in part)
            parts.append(f"Of {len(part)} {words}, {lapped} lapped from every start, mean progress {progress:.1f} %.")
    rows = [
        (
            one.label, one.role.replace("_", " "), f"{one.full_laps} of {one.laps}",
            f"{one.mean_progress_percent:.1f} %", Bar(one.mean_progress_percent / 100.0),
            f"{one.best_lap_seconds:.2f} s" if one.best_lap_seconds else "–",
        )
        for one in sorted(results, key=lambda one: (one.role != HELD_OUT, one.mean_progress_percent))
    ]  # fmt: skip
    words = f"The evaluation after iteration {iteration}, tracks never seen first, the worst of each first. "
    heads = ("track", "", "full laps", "mean progress", "", "best lap")
    return Judged(words + " ".join(parts), heads, tuple(rows))


def _laps(evaluations: Sequence[Mapping[str, Any]]) -> Judged:
    rows = (
        (
            one["iteration"], f"{one.get('full_laps', 0)} of {len(one['laps'])}",
            f"{one['mean_progress_percent']:.1f} %" if one.get("mean_progress_percent") is not None else "–",
            f"{one['best_lap_seconds']:.2f} s" if one.get("best_lap_seconds") else "–",
        )
        for one in evaluations
    )  # fmt: skip
    return Judged(
        "The greedy policy drives one episode from each of several starts round the track. Latest first.",
        ("iteration", "full laps", "mean progress", "best lap"),
        tuple(rows),
    )


def _ratings(evaluations: Sequence[Mapping[str, Any]]) -> Judged:
    rivals = tuple(evaluations[0].get("against", {}))
    rows = (
        (
            one["iteration"], f"{one['rating']:.0f}", f"{one['rating_low']:.0f} to {one['rating_high']:.0f}",
            *(_won(one.get("against", {}).get(rival)) for rival in rivals),
        )
        for one in evaluations
    )  # fmt: skip
    return Judged(
        "The greedy policy plays the built-in players; what it won of the games against each makes its rating, with "
        "the interval that holds it 95 times of 100. Latest first.",
        ("iteration", "rating (Elo)", "95 %", *(f"won against {rival}" for rival in rivals)),
        tuple(rows),
    )


def _won(told: Mapping[str, Any] | None) -> str:
    return "–" if told is None else f"{told['won']} of {told['games']}"


def _returns(evaluations: Sequence[Mapping[str, Any]]) -> Judged:
    rows = (
        (
            one["iteration"], f"{one['mean_return']:.4g}", f"{one['std_return']:.3g}", one["episodes"],
            f"{one['mean_steps']:.1f}",
        )
        for one in evaluations
    )  # fmt: skip
    threshold = next((one["threshold"] for one in evaluations if one.get("threshold") is not None), None)
    solved = "" if threshold is None else f" A mean of {threshold:g} counts as solved."
    return Judged(
        f"Episodes of the greedy policy.{solved} Latest first.",
        ("iteration", "mean return", "spread (std)", "episodes", "mean steps"),
        tuple(rows),
    )
