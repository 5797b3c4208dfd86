"""Collects by workers, as the loop expects of any collector. Begin with `ClusterCollector.collect`."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from racecraft.algorithms.learner import Learner, counting
from racecraft.algorithms.rollout_batch import RolloutBatch, concat_rows
from racecraft.algorithms.weights import to_arrays
from racecraft.cluster.messages import RolloutResult, Task, WorkerInit, bytes_of
from racecraft.cluster.shares import Share
from racecraft.cluster.transport import Ticket
from racecraft.cluster.worker_pool import WorkerPool, starts_of
from racecraft.contract.world import Array, EpisodeRecord, WorldSpec
from racecraft.formats.episodes import columns_of_all
from racecraft.rollout.collector import WorkerLayoutError
from racecraft.training.remote_collection import TickCallback
from racecraft.training.run_writer import Stateful


@dataclass
class Traffic:
    """What passed between a training and its workers."""

    steps: int = 0
    """Environment steps collected."""
    bytes_in: int = 0
    """Of arrays that came from workers."""
    bytes_out: int = 0
    """Of arrays that went to them, counted once a worker."""
    busy_seconds: float = 0.0
    """That workers spent collecting, added up."""
    processor_seconds: float = 0.0
    """Of the processor, by all threads of the workers meanwhile, added up."""
    here_seconds: float = 0.0
    """Of the processor, by the thread that asks, from asking to having what was collected."""

    def count(self, task: Task, harvests: Sequence[RolloutResult]) -> None:
        """Count one collecting."""
        self.steps += sum(harvest.steps for harvest in harvests)
        self.bytes_in += sum(map(bytes_of, harvests))
        self.bytes_out += bytes_of(task) * len(harvests)
        self.busy_seconds += sum(harvest.seconds for harvest in harvests)
        self.processor_seconds += sum(harvest.processor_seconds for harvest in harvests)


class Updates:
    """How many updates the learner has taken; workers are told."""

    def __init__(self) -> None:
        self.count = 0

    def add(self) -> None:
        """Count one."""
        self.count += 1


@dataclass(frozen=True)
class Sent:
    """A task under way."""

    task: Task
    questions: dict[Ticket, int]
    """Each with its worker's place."""
    parts: Mapping[str, Any]
    """States of the training's further parts when it was sent."""


class ClusterCollector:
    """Carries a learner through the worlds of a crew.

    Args:
        crew: Workers whose worlds are open.
        spec: What their worlds promise together.
        learner: Whose weights they decide with.
        updates: How many updates it has taken.
        parts: The training's further parts, which workers have, too.
        ahead: Whether workers begin the next collecting while the learner learns from this one, with the weights of
            before: for learners that remember, to which a little age does no harm.
        hears: Hears of the ticks, where they are kept.
    """

    def __init__(
        self,
        crew: WorkerPool,
        spec: WorldSpec,
        learner: Learner,
        updates: Updates,
        parts: Mapping[str, Stateful],
        ahead: bool = False,
        hears: TickCallback | None = None,
    ) -> None:
        self._crew, self._spec, self._learner = crew, spec, learner
        self._updates, self._parts, self._ahead = updates, parts, ahead
        self._hears = hears
        self._specs = [opened.spec for opened in crew.opened]
        self._numbers = numbers_of([order.share for order in crew.orders], self._specs)
        self._states: list[Mapping[str, Any] | None] = [None] * len(self._specs)
        self._looks: list[Callable[[], None]] = []
        self._episodes: list[EpisodeRecord] = []
        self._ticks: list[dict[str, Array]] = []
        self._under_way: Sent | None = None
        self._times_begun = self._iteration = self.steps_taken = 0
        self._begun = False
        self.traffic = Traffic()

    def collect(self) -> RolloutBatch:
        """Have every worker carry on for the horizon; return what happened, the rows of all side by side."""
        return self._collect(None)

    def collect_episodes(self, quota: int) -> RolloutBatch:
        """Have each agent of every worker play `quota` whole episodes."""
        return self._collect(quota)

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call, worker by worker."""
        episodes, self._episodes = self._episodes, []
        return episodes

    def pop(self, iteration: int) -> dict[str, Array]:
        """Return the ticks since the last call as the columns of `formats/episodes.py`, worlds numbered through."""
        ticks, self._ticks = self._ticks, []
        joined = columns_of_all(ticks)
        joined["iteration"][:] = iteration
        return joined

    def set_poll_callback(self, look: Callable[[], None]) -> None:
        """Have somebody called while workers are at work."""
        self._looks.append(look)

    def state(self) -> dict[str, Any]:
        """Return where every worker stands, by place, and the counts of all."""
        states = [state for state in self._states if state is not None]
        counts = states[0]["collector"]["counts"]
        return {
            "workers": {str(place): state for place, state in enumerate(states)},
            "exploration": states[0]["collector"]["exploration"],
            "counts": {
                **counts,
                "resets": np.array(self._times_begun + 1),
                "steps_taken": np.array(self.steps_taken),
                "iteration": np.array(self._iteration),
            },
        }

    def restore(self, state: Mapping[str, Any], anew: bool = False) -> None:
        """Go on from what `state` gave, of as many workers; with `anew`, from that of any collector.

        Raises:
            WorkerLayoutError: It is the state of fewer or more workers, or of none.
        """
        here, there = len(self._specs), len(state.get("workers", ()))
        if not anew and here != there:
            raise WorkerLayoutError(
                "its worlds were carried by {note} and are by {here} now",
                note=f"{there} workers" if there else "one process",
                here=here,
            )
        counts = state["counts"]
        self.steps_taken = int(counts["steps_taken"])
        self._iteration = int(counts.get("iteration", 0))
        self._times_begun = int(counts["resets"]) - (0 if anew else 1)
        if not anew:
            self._states = [state["workers"][str(place)] for place in range(here)]

    def _collect(self, quota: int | None) -> RolloutBatch:
        worked = time.thread_time()
        self._begin()
        sent, self._under_way = self._under_way or self._send(quota), None
        starts = self._starts(sent.task, sent.parts)
        harvests = self._crew.gather(sent.questions, starts.__getitem__, sent.task, self._look)
        self.traffic.count(sent.task, harvests)
        self._take_in(sent.task, harvests)
        if self._ahead:
            self._under_way = self._send(quota)
        batch = concat_rows([harvest.batch for harvest in harvests])
        self.traffic.here_seconds += time.thread_time() - worked
        return batch

    def _begin(self) -> None:
        if not self._begun:
            self._crew.begin(self._starts(self._task(None), self._states_of_parts()))
            self._begun = True

    def _send(self, quota: int | None) -> Sent:
        task = self._task(quota)
        return Sent(task, self._crew.ask(task), self._states_of_parts())

    def _states_of_parts(self) -> dict[str, Any]:
        return {name: part.state() for name, part in self._parts.items()}

    def _task(self, quota: int | None) -> Task:
        counter = counting(self._learner)
        return Task(
            weights=to_arrays(self._learner.state_dict()["network"]),
            version=self._updates.count,
            explored=None if counter is None else counter.explored,
            quota=quota,
            iteration=self._iteration + 1,
        )

    def _starts(self, task: Task, parts: Mapping[str, Any]) -> list[WorkerInit]:
        """Return where the workers of all places begin, or their successors go on, with the weights of a task."""
        start = WorkerInit(
            spec=self._spec,
            first_row=0,
            weights=task.weights,
            version=task.version,
            parts=parts,
            state=None,
            times_begun=self._times_begun,
        )
        return starts_of(start, self._specs, self._states)

    def _take_in(self, task: Task, harvests: Sequence[RolloutResult]) -> None:
        came: list[dict[str, Array]] = []
        for place, (numbers, harvest) in enumerate(zip(self._numbers, harvests, strict=True)):
            self._states[place] = harvest.state
            self._episodes += [replace(one, world=int(numbers[one.world])) for one in harvest.episodes]
            if harvest.ticks is not None:
                came += neighbours({**harvest.ticks, "world": numbers[harvest.ticks["world"]]})
        came.sort(key=lambda ticks: int(ticks["world"][0]))
        self._ticks += came
        if self._hears is not None and came:
            self._hears(came)
        self._iteration = task.iteration
        self.steps_taken += sum(harvest.steps for harvest in harvests)
        if (counter := counting(self._learner)) is not None:
            counter.explored += sum(harvest.steps for harvest in harvests)

    def _look(self) -> None:
        for look in self._looks:
            look()


def numbers_of(shares: Sequence[Share], specs: Sequence[WorldSpec]) -> list[Array]:
    """Return which of all worlds those of each worker are, int64 (its worlds,).

    Where worlds are of one kind they are numbered worker by worker, as many as a worker's show: in self-play they are
    the learner's seats, and not the games that were shared out.
    """
    if len(shares[0].blocks) > 1:
        return [share.worlds for share in shares]
    ends = np.cumsum([spec.num_worlds for spec in specs])
    return [np.arange(end - spec.num_worlds, end) for end, spec in zip(ends, specs, strict=True)]


def neighbours(ticks: Mapping[str, Array]) -> list[dict[str, Array]]:
    """Return ticks, ordered by world, in pieces of which each has worlds of neighbouring numbers."""
    breaks = np.flatnonzero(np.diff(ticks["world"]) > 1) + 1
    pieces = {name: np.split(column, breaks) for name, column in ticks.items()}
    return [{name: parts[number] for name, parts in pieces.items()} for number in range(len(breaks) + 1)]
