"""Example data for the page that shows every part in every state. Begin with `every_part`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from racecraft.pages.chart import Band, Chart, Level, Mark, Series


def every_part() -> dict[str, Any]:
    """Return what `every_part.html` names."""
    return {
        "title": "Every part",
        "menu": [
            {"label": label, "href": f"#{icon}", "icon": icon, "here": label == "Garage"}
            for label, icon in (
                ("Garage", "car"), ("Tracks", "track"), ("Races", "flag"), ("Lessons", "book"), ("Drive", "wheel"),
                ("Jobs", "pulse"), ("Settings", "gear"),
            )
        ],
        "machine": "1 trains, 2 wait",
        "stats": [
            ("10.20 s", "best lap"), ("97 %", "of drives finish"), ("1,283", "steps a second"), ("–", "not known"),
        ],
        "models": [
            ("a-name-of-sixty-four-letters-that-has-to-be-cut-somewhere-or-wrapped", "training", "41 %", "10.93", 0.41),
            ("first-car", "ready", "100 %", "10.20", 1.0),
            ("made <b>bold</b>", "error", "3 %", "–", 0.03),
        ],
        "charts": [chart.shown() for chart in _charts()],
        "track": [(5 * math.cos(a), 2.2 * math.sin(a) + math.sin(2 * a) / 2) for a in _angles()],
    }  # fmt: skip


def _charts() -> Iterator[Chart]:
    steps = list(range(120))
    score = [100 * (1 - math.exp(-k / 40)) + 8 * math.sin(k * 1.7) for k in steps]
    yield Chart(
        "Does it learn?", "iteration", "progress, %",
        [
            Series("training", steps, score, colour=2),
            Series("evaluation", steps[::10], score[::10], "both", colour=1),
            Series("average reward", steps, [k / 4 + math.sin(k) for k in steps], right=True, colour=3),
        ],
        right="reward", low=0, smooth=True,
    )  # fmt: skip
    yield Chart(
        "Is it getting faster?", "lap", "lap time, s",
        [Series("laps", steps, [9 + 6 * math.exp(-k / 30) + abs(math.sin(k * 3)) for k in steps], "dots")],
        levels=[Level(8.75, "best known lap")],
    )  # fmt: skip
    far = [k / 6 for k in range(100)]
    yield Chart(
        "Where is time lost?", "distance, m", "speed, m/s",
        [
            Series("lap 12", far, [2.5 + math.sin(d / 2) for d in far]),
            Series("best lap", far, [2.8 + math.sin(d / 2 + 0.2) for d in far], "dashed"),
        ],
        bands=[Band("all laps", far, [2 + math.sin(d / 2) for d in far], [3.1 + math.sin(d / 2) for d in far])],
        marks=[Mark(4, "turn 1", 6), Mark(10.5, "turn 2", 13)],
    )  # fmt: skip
    yield Chart(
        "How many drives end there?", "distance, m", "drives",
        [Series("ended", range(12), [3, 0, 1, 8, 21, 2, 0, 0, 1, 5, 2, 1], "bars")], low=0, digits=0,
    )  # fmt: skip
    yield Chart("Nothing yet", "iteration", "loss", [Series("loss", [], [])])


def _angles() -> list[float]:
    return [k * math.pi / 20 for k in range(40)]
