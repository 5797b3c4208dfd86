"""Cars that drive a track one way in one episode and the other way in the next, as one `World`.

What it is       two RaceWorlds of the same cars, one for each direction; each car takes part in one of them at a time
Begins           every other car in the given direction, the others against it, so that a batch has both from the first
                 tick; a car turns wherever an episode begins at rest, not where it drives on over the finish
Starts           each direction moves its own starts on, so that each is driven from all of them
Source           simapp's ALTERNATE_DRIVING_DIRECTION, which turns round after each training episode (deepracer.md 6)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from racecraft.contract.errors import ContractError
from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, WorldSpec, allocate
from racecraft.worlds.deepracer.env.fidelity import AwsQuirks
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.track import Track

SEED_APART = 3_571
"""The seeds of the two directions lie so far apart."""


class AlternatingWorld:
    """N cars, each alone in its world, in turn in two RaceWorlds.

    Args:
        first: In the given direction.
        other: The same cars in the opposite one; a reward function's copies may be common to both.
        first_car: The number of its first car, where others drive those before: the odd ones begin in the opposite way.

    Raises:
        ContractError: They differ in what a car sees or can be told, or have several cars a world.
    """

    def __init__(self, first: RaceWorld, other: RaceWorld, first_car: int = 0) -> None:
        if first.spec.num_agents != 1 or replace(other.spec, name=first.spec.name) != first.spec:
            raise ContractError(
                "{first} and {other} are not the same cars, one a world", first=first.spec, other=other.spec
            )
        self.ways, self._first_car = (first, other), first_car
        self._own = allocate(other.spec)
        """What the cars see and earn that drive the other way."""
        self.reports = first.reports.copy()
        """What was written down of every car in the tick just taken, TICK_REPORT (N, 1)."""
        self._is_other = self._first_ways()
        """Which cars drive the other way, bool (N, 1)."""
        self._reported_other = self._is_other.copy()
        """The same in the tick that the reports are of."""
        self._finished: list[EpisodeRecord] = []

    @property
    def spec(self) -> WorldSpec:
        """The shape of this world's promise."""
        return self.ways[0].spec

    @property
    def track(self) -> Track:
        """The circuit in the given direction."""
        return self.ways[0].track

    @property
    def track_lengths(self) -> Array:
        """Length of each world's centre line, m (N,)."""
        return self.ways[0].track_lengths

    @property
    def seen_boxes(self) -> Array:
        """Boxes and bots where they stood in the tick just taken, (N, K, 6)."""
        first, other = (way.seen_boxes for way in self.ways)
        return np.where(self._reported_other[..., None], other, first)

    @property
    def variation(self) -> Array | None:
        """What the episodes have drawn that the reports are of, (N, 1); None where all are alike."""
        first, other = (way.variation for way in self.ways)
        return None if first is None or other is None else np.where(self._reported_other, other, first)

    @property
    def habits(self) -> AwsQuirks:
        """Which of the original's bugs these worlds have."""
        return self.ways[0].habits

    @property
    def has_reward(self) -> bool:
        """Whether a reward function is asked."""
        return self.ways[0].has_reward

    @property
    def start_shares(self) -> Array:
        """Where each car first starts, share of the lap in its direction (N,)."""
        return self.ways[0].start_shares

    @property
    def episodes_started(self) -> int:
        """Episodes that all cars together have begun since `reset`, less the first of each."""
        return sum(way.episodes_started for way in self.ways)

    @property
    def next_start_share(self) -> float:
        """Where the next episode in the given direction would start, share of the lap."""
        return self.ways[0].next_start_share

    def move_starts(self, start_shares: Sequence[float] | Array) -> None:
        """Let the next `reset` line the cars up elsewhere: shares of the lap in each direction, (N,)."""
        for way in self.ways:
            way.move_starts(start_shares)

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Line every car up at its first start."""
        for number, (way, own) in enumerate(zip(self.ways, (buffers, self._own), strict=True)):
            way.reset(own, seed + number * SEED_APART)
        self._is_other = self._first_ways()
        self._finished.clear()
        self._show(np.ones_like(self._is_other), buffers)

    def begin_episodes(self, buffers: StepBuffers) -> None:
        """Put every car at the start of its episode; one that was under way is driven again from its start."""
        for way, own in zip(self.ways, (buffers, self._own), strict=True):
            way.begin_episodes(own)
        self._finished.clear()
        self._show(np.ones_like(self._is_other), buffers)

    def freeze(self, rows: Array) -> None:
        """Let cars (bool (N, 1)) stand where they are until `begin_episodes` or `reset`."""
        for way, elsewhere in zip(self.ways, (self._is_other, ~self._is_other), strict=True):
            way.freeze(rows | elsewhere)

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Advance every car by one tick in its direction; a car that begins at rest thereafter begins in the other.

        Raises:
            ContractError: `actions` are not one action for every car.
            RewardError: The user's reward function failed.
        """
        first, other = self.ways
        first.step(actions, buffers)
        other.step(actions, self._own)
        rows = self._is_other[:, 0]
        for name, whole in buffers.final_observations.items():
            whole[rows] = self._own.final_observations[name][rows]
        for name in ("reward", "terminated", "truncated"):
            getattr(buffers, name)[rows] = getattr(self._own, name)[rows]
        self._write_reports(rows)
        self._finished += [*first.pop_episodes(), *other.pop_episodes()]
        at_rest = np.where(self._is_other, other.cars["preparing"], first.cars["preparing"])
        turned = (buffers.terminated | buffers.truncated) & at_rest
        self._is_other ^= turned
        self._show(turned, buffers)

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call, oldest first."""
        finished, self._finished = self._finished, []
        return finished

    def save_state(self) -> dict[str, Array]:
        """Return the state of both directions, and which way each car drives."""
        state = {f"{n}/{name}": part for n, way in enumerate(self.ways) for name, part in way.save_state().items()}
        return state | {"is_other": self._is_other.copy()}

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on from a saved state."""
        for number, (way, own) in enumerate(zip(self.ways, (buffers, self._own), strict=True)):
            head = f"{number}/"
            way.load_state({name[len(head) :]: part for name, part in state.items() if name.startswith(head)}, own)
        self._is_other = state["is_other"].reshape(self._is_other.shape).astype(bool)
        self._finished.clear()
        self._show(np.ones_like(self._is_other), buffers)

    def close(self) -> None:
        """Nothing is held open."""

    def _first_ways(self) -> Array:
        cars = self._first_car + np.arange(self.spec.num_worlds)
        return (cars % 2 == 1)[:, None]

    def _write_reports(self, rows: Array) -> None:
        """Keep the report of the direction that each car drove in; its episodes are numbered through both."""
        self.reports[:] = self.ways[0].reports
        self.reports[rows] = self.ways[1].reports[rows]
        episodes = [way.cars["episode"] for way in self.ways]
        self.reports["episode"] += np.where(self._is_other, *episodes)
        self._reported_other[:] = self._is_other

    def _show(self, turned: Array, buffers: StepBuffers) -> None:
        """Let each car take part in its direction alone, and show what all of them see now, those that turned too."""
        sides = ((self.ways[0], ~self._is_other, buffers), (self.ways[1], self._is_other, self._own))
        if turned.any():
            for way, present, own in sides:
                way.take_part(present, turned & present, own)
        rows = self._is_other[:, 0]
        for name, whole in buffers.observations.items():
            whole[rows] = self._own.observations[name][rows]
        buffers.active[rows] = self._own.active[rows]
