"""What passes between a training and its workers: plain values and arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.cluster.shares import Share
from racecraft.contract.world import Array, EpisodeRecord, WorldSpec


@dataclass(frozen=True)
class WorkerEnv:
    """Where the training runs, so that a worker finds the user's own modules and files where it can."""

    search_path: tuple[str, ...]
    folder: str


@dataclass(frozen=True)
class WorkerConfig:
    """Which worlds a worker opens."""

    kind: str
    """The name of a `WorldKind`."""
    planned: Any
    """The plan of that kind, with the share's worlds."""
    share: Share


@dataclass(frozen=True)
class WorkerReady:
    """What a worker says once its worlds are open."""

    spec: WorldSpec
    """What its worlds promise."""
    host: str
    pid: int
    versions: Mapping[str, str]


@dataclass(frozen=True)
class WorkerInit:
    """Where a worker begins: at the beginning, or where another one was."""

    spec: WorldSpec
    """What the worlds of all workers promise together."""
    first_row: int
    """Which of all rows is its first."""
    weights: Mapping[str, Array]
    version: int
    """How many updates these weights have heard of."""
    parts: Mapping[str, Any]
    """States of the training's further parts, as they are after that update."""
    state: Mapping[str, Any] | None
    """Where the worker before it was; None: at the beginning."""
    times_begun: int
    """How often all worlds were begun anew before; each time they have chance of their own."""


@dataclass(frozen=True)
class Task:
    """One collecting."""

    weights: Mapping[str, Array]
    version: int
    """How many updates these weights have heard of."""
    explored: int | None
    """Decisions drawn by all until then, where exploration falls with them."""
    quota: int | None
    """Whole episodes of each agent; None: the horizon's ticks."""
    iteration: int


@dataclass(frozen=True)
class RolloutResult:
    """What one worker collected, and where it stands now."""

    batch: RolloutBatch
    episodes: list[EpisodeRecord]
    ticks: dict[str, Array] | None
    """For the episode files; None where they are not kept."""
    steps: int
    """Environment steps taken in this collecting."""
    seconds: float
    """Spent on it."""
    processor_seconds: float
    """Of the processor, by all threads of the worker; not much more than `seconds` where it keeps to one core."""
    state: dict[str, Any]
    """All that another worker needs to go on from here."""


@dataclass(frozen=True)
class WorkerError:
    """What went wrong in a worker, in words: errors do not travel, their letters do."""

    message: str
    is_users: bool
    """Whether it is something that the user gave and that cannot be used."""


def bytes_of(value: Any) -> int:
    """Return how many bytes the arrays in a message hold."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    if isinstance(value, Mapping):
        return sum(map(bytes_of, value.values()))
    if isinstance(value, list | tuple):
        return sum(map(bytes_of, value))
    return bytes_of(vars(value)) if isinstance(value, RolloutBatch | RolloutResult | Task) else 0
