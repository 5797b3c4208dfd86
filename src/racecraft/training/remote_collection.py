"""What a training asks of whoever carries its worlds elsewhere. Begin with `RemoteCollector`.

A training collects in its own process unless its experiment names a gatherer; who that is, and how it reaches its
workers, neither the loop nor the files know.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, runtime_checkable

from racecraft.algorithms.learner import Learner
from racecraft.contract.world import Array, StepBuffers, World, WorldSpec
from racecraft.rollout.collector import CollectorProtocol
from racecraft.training.run_writer import Columns, TickRecorder

TickCallback = Callable[[Sequence[Columns]], None]
"""Hears of a rollout when it has come: each worker's ticks, as episode files hold them, worlds numbered through."""


class RemoteCollector(Protocol):
    """Carries a learner through worlds that are elsewhere."""

    @property
    def spec(self) -> WorldSpec:
        """What all of these worlds promise together."""
        ...

    @property
    def recorder(self) -> TickRecorder | None:
        """Hands over the ticks of an iteration; None where they are not kept."""
        ...

    def collector(self, learner: Learner, hears: TickCallback | None) -> CollectorProtocol:
        """Return what collects for a learner, as much at a time as its settings say, and who hears of the ticks."""
        ...


class RecordingObserver(TickRecorder, Protocol):
    """Sees every tick, and hands over those it kept."""

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        """Hear of one tick."""
        ...

    def pop(self, iteration: int) -> Columns:
        """Return the ticks kept since the last call."""
        ...


@runtime_checkable
class HasRngState(Protocol):
    """A part of a training that is the same wherever the same updates are heard of, but for its own dice."""

    def dice(self) -> Array:
        """Return how its dice stand (a copy)."""
        ...

    def set_rng_state(self, dice: Array) -> None:
        """Go on with dice as they stood."""
        ...
