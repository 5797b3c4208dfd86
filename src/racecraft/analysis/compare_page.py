"""A comparison of groups of seeds as a page: verdict, curves, fresh starts, what differs. Begin with `compare_data`.

The parts stand in `pages/templates/compare_parts.html`; the console shows the same ones.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.evaluation.run_groups import Difference, SeedGroup
from racecraft.evaluation.verdict import ScoredGroup, Verdict
from racecraft.formats.atomic import write_atomic
from racecraft.formats.run_folder import RunFolder
from racecraft.pages.chart import Band, Chart, Series
from racecraft.pages.render import render_file

CURVES = ("best_lap_seconds", "evaluation_score")
"""Columns of the metrics that a curve shows: the first where scores are lap times, else the second."""
GRID = 60
"""Places at which the seeds of a group are brought together."""
MIN_BAND = 3
ROW = 46
"""Height of a group's row of dots, in the picture's units; its width is WIDTH."""
WIDTH = 640


@dataclass(frozen=True)
class Compared:
    """Everything that a page of a comparison shows."""

    groups: Sequence[SeedGroup]
    scored: Sequence[ScoredGroup]
    verdict: Verdict
    differing: Sequence[Difference]


def write_compare_page(path: Path, compared: Compared) -> None:
    """Write a page that is one file and works offline.

    Raises:
        OutputFileError: The place cannot be written.
    """
    data = compare_data(compared)
    write_atomic(path, render_file("compare.html", title=data["title"], about=data["about"], told=data))


def compare_data(compared: Compared) -> dict[str, Any]:
    """Return what the parts of `compare_parts.html` show, as plain values."""
    seeds = sum(len(group.runs) for group in compared.groups)
    first = compared.scored[0].scores[0]
    return {
        "title": "Compare" if len(compared.groups) > 1 else f"Seeds of {compared.groups[0].name}",
        "about": f"{seeds} runs, each judged from {len(first.values)} fresh starts",
        "head": compared.verdict.sentences[0],
        "reasons": compared.verdict.sentences[1:],
        "groups": _groups(compared),
        "curves": _curves(compared).shown(),
        "dots": dots([(group.name, [one.values for one in group.scores]) for group in compared.scored], first.name),
        "differing": _differing(compared),
    }


def _groups(compared: Compared) -> dict[str, Any]:
    """Return a row a group, the best first."""
    verdict, rows = compared.verdict, []
    written = verdict.measure.written
    for place in verdict.order:
        group, mean = compared.scored[place], verdict.means[place]
        interval = "–" if mean.low is None or mean.high is None else f"{mean.low:.2f} to {mean.high:.2f}"
        reached = float(np.mean([one.reached_share for one in group.scores]))
        each = ", ".join(written(one) for one in group.seeds(verdict.measure.by_fallback))
        rows.append((group.name, len(group.scores), written(mean.value), interval, f"{100 * reached:.0f} %", each))
    heads = ("group", "seeds", verdict.measure.name, "95 %", "finished", "each seed")
    return {"heads": heads, "rows": rows}


def _curves(compared: Compared) -> Chart:
    is_lap = compared.scored[0].scores[0].less_is_better
    if is_lap and not compared.verdict.measure.by_fallback:
        return curves_chart(compared.groups, "While training", "best lap, s", CURVES[0])
    return curves_chart(compared.groups, "While training", "evaluation score", CURVES[1])


def curves_chart(groups: Sequence[SeedGroup], title: str, unit: str, column: str) -> Chart:
    """Return a column of the metrics by steps: thin each seed, bold their median, a band between the quartiles."""
    series, bands = [], []
    for number, group in enumerate(groups, 1):
        named = [(one.name, *curve_of(one.run, column)) for one in group.runs]
        curves = [(steps, values) for _, steps, values in named if len(steps)]
        series += [
            Series(name, steps.tolist(), values.tolist(), colour=number, faint=len(curves) > 1)
            for name, steps, values in named
            if len(steps)
        ]
        if len(curves) > 1:
            steps, low, middle, high = (part.tolist() for part in _together(curves))
            series.append(Series(f"{group.name}: median", steps, middle, colour=number))
            if len(curves) >= MIN_BAND:
                bands.append(Band(f"{group.name}: middle half", steps, low, high, colour=number))
    return Chart(title, "steps", unit, series, bands=bands)


def curve_of(run: RunFolder, column: str) -> tuple[Array, Array]:
    """Return steps and values of a column of a run's metrics where it has one, (K,) each."""
    rows = [(row["steps"], row[column]) for row in run.read_metrics() if row.get(column) is not None and "steps" in row]
    points = np.array(rows, float).reshape(-1, 2)
    return points[:, 0], points[:, 1]


def _together(curves: Sequence[tuple[Array, Array]]) -> tuple[Array, Array, Array, Array]:
    """Return steps and the quartiles of several curves, where all of them are known, (GRID,) each."""
    first, last = max(steps[0] for steps, _ in curves), min(steps[-1] for steps, _ in curves)
    steps = np.linspace(first, max(first, last), GRID)
    low, middle, high = np.percentile([np.interp(steps, *curve) for curve in curves], (25, 50, 75), axis=0)
    return steps, low, middle, high


def dots(groups: Sequence[tuple[str, Sequence[Sequence[float | None]]]], unit: str) -> dict[str, Any]:
    """Return every fresh start as a dot, a row a group, each seed on a line of its own.

    Args:
        groups: Name, and of each seed a score a start; None or infinite where the goal was not reached.
        unit: What a score is.
    """
    finished = [
        [[one for one in seed if one is not None and math.isfinite(one)] for seed in seeds] for _, seeds in groups
    ]
    values = [one for seeds in finished for seed in seeds for one in seed]
    if not values:
        return {"rows": [], "ticks": [], "height": 0, "width": WIDTH, "unit": ""}
    least, most = min(values), max(values)
    span = max(most - least, 1e-9)

    def place(value: float) -> float:
        return round(20.0 + (WIDTH - 40.0) * (value - least) / span, 1)

    rows = []
    for number, ((name, _), seeds) in enumerate(zip(groups, finished, strict=True)):
        top, scores = number * ROW, [one for seed in seeds for one in seed]
        lines = [round(top + ROW * (0.22 + 0.56 * (k + 0.5) / len(seeds)), 1) for k in range(len(seeds))]
        rows.append({
            "name": name, "colour": number % 6 + 1, "top": top + 6, "bottom": top + ROW - 6,
            "dots": [(place(one), line) for seed, line in zip(seeds, lines, strict=True) for one in seed],
            "median": place(float(np.median(scores))) if scores else None,
        })  # fmt: skip
    ticks = [(place(value), f"{value:.2f}") for value in np.linspace(least, most, 5)]
    return {"rows": rows, "ticks": ticks, "height": ROW * len(rows), "width": WIDTH, "unit": unit}


def _differing(compared: Compared) -> dict[str, Any]:
    rows = [(one.name, *(_value(value) for value in one.values)) for one in compared.differing]
    return {"heads": ("setting", *(group.name for group in compared.groups)), "rows": rows}


def _value(value: Any) -> str:
    return "–" if value is None else str(value)
