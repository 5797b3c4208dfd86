"""A worker's worlds once more beside the learner, so that actions travel and frames do not. Begin with `Twin.follow`.

A world is the same, bit by bit, wherever the same is done in it. So what a worker saw need not be sent: its twin does
what the worker did and sees it again, whatever the sensors, with objects on the road and with variation. Where the
worker then stands, it says, and the twin must stand there, too; processors that calculate differently are found out.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.cluster.messages import Deeds, Harvest, Opened, Start, Task
from racecraft.cluster.shares import Share
from racecraft.cluster.transport import ClusterError
from racecraft.contract.world import Array, StepBuffers, World
from racecraft.rollout.collector import Collector
from racecraft.rollout.episodes import StepObserver
from racecraft.rollout.repeating import Repeats
from racecraft.training.gathering import RecordingObserver

PAID_APART = "reward_sums"
"""What a twin's state need not share: it is paid with the rewards that were sent, and its world asks for none."""


class Twin:
    """One worker's worlds, driven again as it drove them.

    Args:
        world: Like the worker's, and not paid.
        share: What the worker carries.
        opened: The worker.
        start: Where it begins.
        recorder: Keeps the ticks, where they are kept.
    """

    def __init__(
        self, world: World, share: Share, opened: Opened, start: Start, recorder: RecordingObserver | None
    ) -> None:
        self._share, self._opened, self._recorder = share, opened, recorder
        self._deeds = Deeds(np.zeros(0), np.zeros(0), {})
        self._actor = Repeats()
        observers: list[StepObserver] = [self._pay, *([] if recorder is None else [recorder])]
        self._collector = Collector(world, self._actor, start.horizon, share.seed_of(start.times_begun), observers)
        if start.state is not None:
            self._collector.restore(start.state["collector"])
        self.seconds = 0.0
        """Spent here so far."""

    def follow(self, task: Task, harvest: Harvest) -> Harvest:
        """Return what a worker harvested, with all that it saw.

        Raises:
            ClusterError: What was done there leads somewhere else here.
        """
        assert isinstance(harvest.batch, Deeds)
        began = time.perf_counter()
        self._deeds, collector = harvest.batch, self._collector
        self._actor.take_up(harvest.batch.actions)
        batch = collector.collect() if task.quota is None else collector.collect_episodes(task.quota)
        collector.take_episodes()  # the worker told them
        state = collector.state()
        self._require_same(harvest.state["collector"]["world"], state["world"])
        self.seconds += time.perf_counter() - began
        return replace(
            harvest,
            batch=replace(batch, columns=dict(self._deeds.columns)),
            ticks=None if self._recorder is None else self._recorder.take(task.iteration),
            state={**harvest.state, "collector": {**harvest.state["collector"], "shown": state["shown"]}},
        )

    def _pay(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        buffers.reward[:] = self._deeds.reward[self._actor.tick - 1].reshape(buffers.reward.shape)

    def _require_same(self, there: Mapping[str, Array], here: Mapping[str, Array]) -> None:
        for name, part in here.items():
            same = name.endswith(PAID_APART) or np.array_equal(part, there[name], equal_nan=True)
            if not same:
                raise ClusterError(
                    f"cluster: worker {self._share.place} on {self._opened.host} stands elsewhere after the same "
                    f"actions than its worlds do here ({name}); expected processors that calculate alike. Let frames "
                    "travel: --set cluster.send=frames."
                )


def deeds_of(batch: RolloutBatch) -> Deeds:
    """Return what a twin must be told of a rollout."""
    return Deeds(batch.actions, batch.reward, batch.columns)
