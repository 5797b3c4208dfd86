"""What the checkpoints of a training will take of the disk, said before it begins. Begin with `forecast`."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from racecraft.formats.checkpoint import STATES_KEPT
from racecraft.training.settings import RuntimeConfig
from racecraft.training.stopping import StopCondition

NOTABLE_BYTES = 10**9
NOTABLE_SHARE = 0.5
"""Of what is free."""
STATE_PER_WEIGHTS = 3
"""A trainer's state holds the weights and two moments of Adam for each."""


@dataclass(frozen=True)
class DiskForecast:
    """Bytes of checkpoints a training comes to, at most."""

    weights: int
    """Of one checkpoint."""
    kept: int | None
    """How many stay in the end; None: as many as `runtime.keep_mib` allows, since nobody knows how long it takes."""
    total: int
    free: int
    """Of the disk that the run lies on, before."""

    def sentence(self) -> str:
        """Return what is worth saying; "" where the disk is no matter."""
        is_much = self.kept is not None and self.total >= NOTABLE_BYTES
        if not is_much and self.total < NOTABLE_SHARE * self.free:
            return ""
        each = f"{_gb(self.weights)} each" + ("" if self.kept is None else f", {self.kept} kept")
        text = f"checkpoints take up to {_gb(self.total)} of the disk ({each}); {_gb(self.free)} are free"
        return f"{text}. --keep best,last,10 keeps fewer." if self.total > NOTABLE_SHARE * self.free else text


def forecast(
    weights: Mapping[str, np.ndarray], settings: RuntimeConfig, stops: Iterable[StopCondition], steps: int, folder: Path
) -> DiskForecast:
    """Return what checkpoints take at most, from the size of one and what stops the training.

    Args:
        weights: Of the policy, by name.
        settings: What is kept.
        stops: The stop conditions; those by iterations and steps say how long it takes.
        steps: Environment steps of one iteration, the shortest where they grow.
        folder: Where the run lies.
    """
    each = sum(array.nbytes for array in weights.values())
    iterations = min((_iterations(stop, steps) for stop in stops), default=None, key=lambda count: count or np.inf)
    always = 2 + STATES_KEPT  # the untrained and the best
    kept = None if iterations is None else min(iterations + 1, iterations // settings.keep_every + always)
    if settings.keep_count is not None:
        kept = min(settings.keep_count + always, kept or settings.keep_count + always)
    most = settings.keep_mib * 2**20
    total = (most if kept is None else min(kept * each, most)) + STATES_KEPT * STATE_PER_WEIGHTS * each
    return DiskForecast(each, kept, total, shutil.disk_usage(folder).free)


def _iterations(stop: StopCondition, steps: int) -> int | None:
    if stop.kind == "iterations":
        return int(stop.amount)
    return math.ceil(stop.amount / steps) if stop.kind == "steps" else None


def _gb(size: int) -> str:
    return f"{size / 1e9:.2g} GB" if size >= 10**8 else f"{max(size / 1e6, 0.1):.2g} MB"
