"""Which of the original's cars a recording shows, and how sure that is. Begin with `judge_car`.

Two things tell. What the simulator wrote down of its own build: the classic one (ROS 1) drove `v4` and `v5-classic`,
the ROS 2 one drives `v6`. And how far each car strays, blind, from the recorded one. Cars that drive slowly stray by
nearly the same, 10 to 12 cm after a second: then the recording cannot tell.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array

RECORDED_CARS = ("v4", "v5-classic", "v6")
"""Cars that races were recorded with."""
CARS_OF_BUILDS = {"ROS 1": ("v4", "v5-classic"), "ROS 2": ("v6",)}
"""Build of the simulator → the cars it has."""
MIN_WINDOWS = 20
"""Fewer windows of driving tell nothing."""
CLEAR_RATIO = 1.3
"""The nearest car is the recorded one where the next strays so many times as far, at the low end of the interval: so it
is told in 14 of 18 public recordings of 2021 to 2026, each time as their own metadata or logs have it."""
BLOCKS, DRAWS = 20, 400
"""The interval: windows overlap, so blocks of neighbours are drawn, not windows."""


@dataclass(frozen=True)
class CarVerdict:
    """Which car a recording shows."""

    car: str | None
    """One of RECORDED_CARS; None: the recording cannot tell."""
    nearest: str
    """The car that strays least of those that the build has."""
    strayed_m: dict[str, float | None]
    """By car: median distance from the recorded one after a second, m; None without a window that long."""
    ratio: tuple[float, float] | None
    """How many times as far the next car strays, 95 % interval; None where the build alone tells, or nothing does."""
    build: str | None
    """A key of CARS_OF_BUILDS, as the recording says; None where it does not."""

    def text(self) -> str:
        """Return the verdict and its reason, a clause.

        >>> CarVerdict(None, "v6", {"v4": 0.115, "v6": 0.111}, (0.98, 1.09), None).text()
        'the recording cannot tell the car (after a second v4 0.12 m, v6 0.11 m away)'
        """
        tried = ", ".join(f"{car} {far:.2f} m" for car, far in self.strayed_m.items() if far is not None)
        strayed = f"after a second {tried} away" if tried else "no stretch is long enough"
        text = f"recorded by the {self.build} build" if self.build else ""
        if self.car is None:
            return f"the recording cannot tell the car ({'; '.join(filter(None, (text, strayed)))})"
        if self.ratio is not None:
            text = f"the next car strays {self.ratio[0]:.1f} to {self.ratio[1]:.1f} times as far (95 %)"
        return f"the recording shows {self.car} ({'; '.join(filter(None, (text, strayed)))})"

    def as_dictionary(self) -> dict[str, object]:
        """Return the verdict as plain values, fit for JSON."""
        return {"car": self.car, "nearest": self.nearest, "next_strays_times": self.ratio, "build": self.build}


def judge_car(errors_m: Mapping[str, Array], build: str | None = None) -> CarVerdict:
    """Judge which car was recorded.

    Args:
        errors_m: By car of RECORDED_CARS: distance from the recorded car at the end of each window, m, (W,), NaN where
            the window is too short; the same windows in the same order for all.
        build: A key of CARS_OF_BUILDS where the recording says it.
    """
    is_long = np.all([np.isfinite(far) for far in errors_m.values()], axis=0)
    errors = {car: far[is_long] for car, far in errors_m.items()}
    count = int(is_long.sum())
    strayed = {car: round(float(np.median(far)), 4) if count else None for car, far in errors.items()}
    possible = [car for car in CARS_OF_BUILDS.get(build or "", RECORDED_CARS) if car in errors]
    ordered = sorted(possible, key=lambda car: strayed[car] or 0.0)
    if len(ordered) == 1:
        return CarVerdict(ordered[0], ordered[0], strayed, None, build)
    if count < MIN_WINDOWS:
        return CarVerdict(None, ordered[0], strayed, None, build)
    ratio = _ratio_interval(errors[ordered[0]], errors[ordered[1]])
    return CarVerdict(ordered[0] if ratio[0] >= CLEAR_RATIO else None, ordered[0], strayed, ratio, build)


def _ratio_interval(nearest: Array, following: Array) -> tuple[float, float]:
    """Return the 95 % interval of the ratio of two medians, by drawing blocks of windows."""
    rng = np.random.default_rng(0)
    blocks = np.array_split(np.arange(len(nearest)), BLOCKS)
    ratios = []
    for _ in range(DRAWS):
        rows = np.concatenate([blocks[block] for block in rng.integers(0, BLOCKS, BLOCKS)])
        ratios.append(float(np.median(following[rows]) / max(np.median(nearest[rows]), 1e-9)))
    low, high = np.quantile(ratios, (0.025, 0.975))
    return round(float(low), 3), round(float(high), 3)
