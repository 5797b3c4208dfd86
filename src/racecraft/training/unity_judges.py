"""Who judges a policy in a Unity scene: greedy episodes in a player of its own, or the training episodes themselves.

Begin with `SceneJudge`. Its player stays open, for starting one takes seconds. A RESET need not put an agent back, so
from the second judgement on each agent's first episode, perhaps half told, is left out. The Editor is one player only;
there `TrainingEpisodesJudge` takes what was told anyway.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, World
from racecraft.envs.unity.world import UnityWorld
from racecraft.formats.checkpoint import save_state
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.statistics import summarise
from racecraft.training.bounded_episodes import CUT, play_bounded
from racecraft.training.events import Verdict

OBSERVATIONS_KEPT = 256
SHORTEST_PATIENCE, PATIENCE = 200, 3
"""A judged episode may last so many ticks, or so many times the longest training episode, whichever is more."""


class SceneJudge:
    """Judges by the mean return of greedy episodes in a player of its own.

    Args:
        world: That player; it is not started anew between judgements.
        policy: The judged policy.
        episodes: How many episodes count.
        threshold: The mean return that counts as solved; None where none does.
        observations: Where to keep what the policy saw.
    """

    score_name = "return"

    def __init__(
        self, world: UnityWorld, policy: GreedyPolicy, episodes: int, threshold: float | None, observations: Path
    ) -> None:
        self._world, self._policy, self._episodes, self._threshold = world, policy, episodes, threshold
        self._file, self._judgements, self._longest = observations, 0, 0

    def score(self, episode: EpisodeRecord) -> float:
        """Return an episode's return, and learn how long training episodes get."""
        self._longest = max(self._longest, episode.steps)
        return episode.reward

    def is_full(self, episode: EpisodeRecord) -> bool:
        """Tell whether one episode alone met the threshold."""
        return self._threshold is not None and episode.reward >= self._threshold

    def judge(self) -> Verdict:
        """Play; keep what was seen. A policy that never comes to an end is cut, or it would be judged for ever."""
        rows = self._world.spec.num_worlds
        each, spare = -(-self._episodes // rows), int(self._judgements > 0)
        recorder = Recorder()
        counted = play_bounded(
            self._policy,
            self._world,
            episodes_each=each,
            spare=spare,
            max_ticks=(each + spare) * max(SHORTEST_PATIENCE, PATIENCE * self._longest),
            seed=self._judgements,
            observe=recorder,
        )
        self._judgements += 1
        save_state(self._file, recorder.rows())
        return verdict_on(counted, self._threshold)


class TrainingEpisodesJudge:
    """Judges by the training episodes since the judgement before, where no second player can be had."""

    score_name = "return"

    def __init__(self, threshold: float | None) -> None:
        self._threshold = threshold
        self._told: list[EpisodeRecord] = []
        self._before = Verdict(float("-inf"), False, details={"episodes": 0})

    def score(self, episode: EpisodeRecord) -> float:
        """Return an episode's return, and keep the episode for the next judgement."""
        self._told.append(episode)
        return episode.reward

    def is_full(self, episode: EpisodeRecord) -> bool:
        """Tell whether one episode alone met the threshold."""
        return self._threshold is not None and episode.reward >= self._threshold

    def judge(self) -> Verdict:
        """Take the mean; without an episode the judgement before stands."""
        if self._told:
            self._before = verdict_on(self._told, self._threshold)
            self._told = []
        return self._before


def verdict_on(episodes: list[EpisodeRecord], threshold: float | None) -> Verdict:
    """Return what episodes came to."""
    summary = summarise(episodes)
    details = {
        "episodes": summary.episodes,
        "mean_return": summary.mean_reward,
        "std_return": summary.std_reward,
        "mean_steps": summary.mean_steps,
        "cut": sum(episode.status == CUT for episode in episodes),
        "threshold": threshold,
    }
    return Verdict(summary.mean_reward, threshold is not None and summary.mean_reward >= threshold, details=details)


class Recorder:
    """Keeps the first observations that it is shown."""

    def __init__(self) -> None:
        self._parts: list[dict[str, Array]] = []
        self._count = 0

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        """Look at what active rows see."""
        if self._count < OBSERVATIONS_KEPT:
            active = buffers.active
            part = {name: values[active].copy() for name, values in buffers.observations.items()}
            self._count += len(next(iter(part.values())))
            self._parts.append(part)

    def rows(self) -> dict[str, Array]:
        """Return observations by name, (R, …), at most OBSERVATIONS_KEPT."""
        names = self._parts[0] if self._parts else {}
        return {name: np.concatenate([part[name] for part in self._parts])[:OBSERVATIONS_KEPT] for name in names}
