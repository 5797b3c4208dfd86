"""Does an exported file act as its checkpoint does? Begin with `compare`.

File and checkpoint are asked about the same moments, which the car sees while it drives its own track; every action
must be the same. A policy that was trained on smaller frames goes out as a file that averages the car's 160 x 120
pixels down to them; there the checkpoint is shown the same averages, and besides it is told how often the file decides
as the checkpoint does on the simulator's own small frames.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from racecraft.algorithms.plain_layers import WORTHS
from racecraft.contract.errors import RacecraftError
from racecraft.contract.world import Array
from racecraft.formats.policy_layers import DISCRETE, PolicyLayers
from racecraft.worlds.deepracer.export.car_frames import drive_for_frames
from racecraft.worlds.deepracer.players.trained_car import TrainedCar

TOLERANCE = 1e-4
"""How far numbers in [-1, 1] units, and likelihoods, may lie apart: float32, sums in another order."""
ALIKE = 0.1
"""Two commands are alike when they lie within a twentieth of their range."""
Answer = Callable[[Mapping[str, Array]], Array]
"""A written file: from the numbers of each sensor, by AWS's name, images float32 (R, 120, 160, C) from 0 to 255, to
likelihoods of choices (R, A), or to commands in [-1, 1] units (R, A)."""


class ExportError(RacecraftError):
    """A model does not act as its checkpoint does; no file is written."""


@dataclass(frozen=True)
class Agreement:
    """How a written file answered beside the checkpoint."""

    frames: int
    """On how many frames they were asked; every action agreed."""
    largest_difference: float
    """Of likelihoods of choices, or of numbers in [-1, 1] units."""
    small_frames_share: float | None
    """Share of the simulator's own small frames on which both choose alike, where the file averages pixels; None: it
    does not."""


def compare(car: TrainedCar, policy: PolicyLayers, answer: Answer) -> Agreement:
    """Ask a written file and its checkpoint side by side.

    Raises:
        ExportError: They do not act alike.
    """
    frames, shrink = drive_for_frames(car), policy.network.shrink
    pairs = list(zip(sorted(frames.whole), policy.network.sensors, strict=True))
    answers = answer({sensor.name: as_fed(frames.whole[ours], sensor.is_image) for ours, sensor in pairs})
    same = {
        ours: averages(frames.whole[ours], shrink) if sensor.is_image and shrink > 1 else frames.whole[ours]
        for ours, sensor in pairs
    }
    difference = _difference(policy.kind, car, answers, same)
    if not difference <= TOLERANCE:
        raise ExportError(
            "{path}: the exported file's answers are up to {difference:g} away from the checkpoint's; "
            "expected {tolerance:g} at most. Nothing was written. Please report this with the run folder.",
            path=car.run.path,
            difference=difference,
            tolerance=TOLERANCE,
        )
    share = None if shrink == 1 else _share_alike(policy.kind, car, answers, frames.seen)
    return Agreement(frames.count, difference, share)


def as_fed(seen: Array, is_image: bool) -> Array:
    """Return what is seen as a file is fed: float32, images (R, H, W, C)."""
    return np.asarray(seen[..., None] if is_image and seen.ndim == 3 else seen, np.float32)


def averages(frames: Array, shrink: int) -> Array:
    """Return frames (R, H, W) or (R, H, W, C) in squares of `shrink` pixels averaged to one, float32 shares of white.

    Shape (R, H/s, W/s) or (R, H/s, W/s, C).
    """
    rows, height, width, *rest = frames.shape
    squares = frames.reshape(rows, height // shrink, shrink, width // shrink, shrink, *rest)
    return squares.mean(axis=(2, 4), dtype=np.float32) / np.float32(255.0)


def _difference(kind: str, car: TrainedCar, answers: Array, seen: Mapping[str, Array]) -> float:
    """Return the largest difference of any answer; infinite where an action differs that is no tie."""
    if kind != DISCRETE:
        return float(np.abs(answers - _in_units(car, car.policy.act(seen))).max())
    likely = _likelihoods(car, seen)
    chosen, expected = answers.argmax(axis=1), likely.argmax(axis=1)
    rows = np.arange(len(answers))
    tied = likely[rows, expected] - likely[rows, chosen] < TOLERANCE
    if not (tied | (chosen == expected)).all():
        return float("inf")
    return float(np.abs(answers - likely).max())


def _likelihoods(car: TrainedCar, seen: Mapping[str, Array]) -> Array:
    """Return how likely each choice is; of worths, what a car's graph makes of them."""
    if car.policy.spec.algorithm not in WORTHS:
        return car.policy.probabilities(seen)
    worths = car.policy.policy.values(seen)
    powers = np.exp(worths - worths.max(axis=1, keepdims=True))
    likely: Array = powers / powers.sum(axis=1, keepdims=True)
    return likely


def _share_alike(kind: str, car: TrainedCar, answers: Array, seen: Mapping[str, Array]) -> float:
    """Return on which share of the simulator's small frames the checkpoint decides as the file on the whole ones."""
    actions = car.policy.act(seen)
    if kind == DISCRETE:
        return float((answers.argmax(axis=1) == actions).mean())
    return float((np.abs(answers - _in_units(car, actions)).max(axis=1) < ALIKE).mean())


def _in_units(car: TrainedCar, actions: Array) -> Array:
    """Return commands as shares of their ranges, [-1, 1]."""
    spec: Any = car.policy.spec.actions
    low, high = np.asarray(spec.low, np.float32), np.asarray(spec.high, np.float32)
    return (2.0 * (actions - low) / (high - low) - 1.0).astype(np.float32)
