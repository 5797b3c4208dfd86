"""Seconds to stable laps, seed by seed: the figure a racer feels."""

from __future__ import annotations

import statistics
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.training.plan import RaceRequest

LIMIT = "minutes=3"
"""A seed that is not stable by then counts as not reached."""


def bench_laps(
    seeds: Iterable[int], on_message: Callable[[str], None], overrides: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Train the car of the preset `fast` once for each seed and return the seconds, their median and spread.

    The clock runs from the first training tick, evaluations in, compilation out. A seed that did not become stable is
    None in the list and counts as infinite in the median.
    """
    reached: dict[int, float | None] = {}
    steps: list[int] = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:
            request = RaceRequest(
                run=Path(folder) / str(seed), preset="fast", seed=seed, stops=("laps", LIMIT), overrides=overrides
            )
            trained = train(request, NullCallback(), lambda text: None)
            reached[seed] = trained.outcome.seconds_to_stable
            steps.append(trained.outcome.steps)
            on_message(f"seed {seed}: {reached[seed] or float('nan'):.2f} s, {trained.outcome.steps} steps")
    known = [float("inf") if value is None else value for value in reached.values()]
    return {
        "seconds_to_stable_laps": [None if value is None else round(value, 2) for value in reached.values()],
        "median_seconds": round(statistics.median(known), 2),
        "lowest_seconds": round(min(known), 2),
        "highest_seconds": round(max(known), 2),
        "median_env_steps": round(statistics.median(steps)),
        "seeds": list(reached),
    }
