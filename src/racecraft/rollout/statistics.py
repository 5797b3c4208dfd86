"""Episodes counted and summed up."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array, EpisodeRecord, ReportsEpisodes, StepBuffers, World


class EpisodeCounter:
    """Adds up rewards and ticks of each agent and tells what every finished episode came to.

    A world that tells its own episodes (`ReportsEpisodes`) is asked instead: it knows the words and the facts.
    """

    def __init__(self, world: World) -> None:
        rows = (world.spec.num_worlds, world.spec.num_agents)
        self._teller = world if isinstance(world, ReportsEpisodes) else None
        self._reward, self._steps = np.zeros(rows, np.float64), np.zeros(rows, np.int64)
        self._finished: list[EpisodeRecord] = []

    def begin(self) -> None:
        """Forget episodes under way: the worlds were begun anew."""
        self._reward[:] = 0.0
        self._steps[:] = 0
        if self._teller is not None:
            self._teller.pop_episodes()

    def count(self, buffers: StepBuffers) -> None:
        """Count one tick."""
        if self._teller is not None:
            return
        self._reward += buffers.reward
        self._steps += 1
        ended = buffers.ended
        if not ended.any():
            return
        for n, m in np.argwhere(ended).tolist():
            status = "terminated" if buffers.terminated[n, m] else "truncated"
            record = EpisodeRecord(n, m, int(self._steps[n, m]), float(self._reward[n, m]), status)
            self._finished.append(record)
        self._reward[ended] = 0.0
        self._steps[ended] = 0

    def pop(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call, oldest first."""
        if self._teller is not None:
            return self._teller.pop_episodes()
        finished, self._finished = self._finished, []
        return finished

    def state(self) -> dict[str, Array]:
        """Return the sums under way (copies)."""
        return {"reward": self._reward.copy(), "steps": self._steps.copy()}

    def restore(self, state: Mapping[str, Array]) -> None:
        """Go on from what `state` gave."""
        self._reward[:] = state["reward"]
        self._steps[:] = state["steps"]


@dataclass(frozen=True)
class EpisodeSummary:
    """Many episodes in a few figures; not-a-number where there was none."""

    episodes: int
    mean_reward: float
    """Mean sum of rewards."""
    std_reward: float
    """Standard deviation of the sums of rewards (population)."""
    mean_steps: float
    """Mean length, in ticks."""
    status_share: dict[str, float]
    """Share of each way to end, 0 to 1, by the world's word for it."""


def summarise(records: Iterable[EpisodeRecord]) -> EpisodeSummary:
    """Return a few figures of many episodes.

    >>> summarise([EpisodeRecord(0, 0, 10, 1.0, "off_track"), EpisodeRecord(0, 0, 30, 3.0, "lap_complete")]).mean_steps
    20.0
    """
    kept = list(records)
    if not kept:
        return EpisodeSummary(0, float("nan"), float("nan"), float("nan"), {})
    rewards = [record.reward for record in kept]
    words = [record.status for record in kept]
    return EpisodeSummary(
        episodes=len(kept),
        mean_reward=float(np.mean(rewards)),
        std_reward=float(np.std(rewards)),
        mean_steps=float(np.mean([record.steps for record in kept])),
        status_share={word: words.count(word) / len(words) for word in dict.fromkeys(words)},
    )
