"""What the evaluations of a car's run came to, as tables: by laps, and track by track."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from racecraft.analysis.evaluations import EvaluationTable, latest_first
from racecraft.pages.parts import Bar
from racecraft.worlds.deepracer.files.generalisation import HELD_OUT, TRAINED, TrackResult


def lap_table(evaluations: Sequence[Mapping[str, Any]]) -> EvaluationTable | None:
    """Return the table of a run's evaluations by laps; None where there is none to show."""
    evaluations = latest_first(evaluations, "laps")
    if not evaluations:
        return None
    rows = (
        (
            one["iteration"], f"{one.get('full_laps', 0)} of {len(one['laps'])}",
            f"{one['mean_progress_percent']:.1f} %" if one.get("mean_progress_percent") is not None else "–",
            f"{one['best_lap_seconds']:.2f} s" if one.get("best_lap_seconds") else "–",
        )
        for one in evaluations
    )  # fmt: skip
    return EvaluationTable(
        "The greedy policy drives one episode from each of several starts round the track. Latest first.",
        ("iteration", "full laps", "mean progress", "best lap"),
        tuple(rows),
    )


def track_table(result: tuple[int, Sequence[TrackResult]] | None) -> EvaluationTable | None:
    """Return how one policy drives on several tracks, the worst first; None where there is one track."""
    if result is None:
        return None
    iteration, results = result
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
    return EvaluationTable(words + " ".join(parts), heads, tuple(rows))
