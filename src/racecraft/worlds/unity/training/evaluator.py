"""Who judges a policy in a Unity scene: greedy episodes in a player of its own, or the training episodes themselves.

Begin with `SceneEvaluator`. Its player stays open, for starting one takes seconds. A RESET need not put an agent back,
so from the second judgement on each agent's first episode, perhaps half told, is left out. The Editor is one player
only; there `TrainingEpisodesEvaluator` takes what was told anyway.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, World
from racecraft.evaluation.evaluate_run import MAX_STEPS
from racecraft.formats.checkpoint import save_state
from racecraft.rollout.episodes import CUT, play_episodes
from racecraft.rollout.statistics import summarise
from racecraft.training.callbacks import EvaluationResult
from racecraft.training.stopping import SCORE
from racecraft.worlds.unity.env.world import UnityWorld
from racecraft.worlds.unity.training.curriculum import Curriculum

OBSERVATIONS_KEPT = 256
SHORTEST_PATIENCE, PATIENCE = 200, 3
"""A judged episode may last so many ticks, or so many times the longest training episode, whichever is more."""


class SceneEvaluator:
    """Judges by the mean return of greedy episodes in a player of its own.

    Args:
        world: That player; it is not started anew between judgements.
        policy: The judged policy.
        episodes: How many episodes count.
        threshold: The mean return that counts as solved; None where none does.
        observations: Where to keep what the policy saw.
        curriculum: Hears of training episodes, too.
    """

    score_name = "return"
    stop_kinds = SCORE

    def __init__(
        self,
        world: UnityWorld,
        policy: Policy,
        episodes: int,
        threshold: float | None,
        observations: Path,
        curriculum: Curriculum | None = None,
    ) -> None:
        self._curriculum = curriculum
        self._world, self._policy, self._episodes, self._threshold = world, policy, episodes, threshold
        self._file, self._judgements, self._longest = observations, 0, 0

    def score(self, episode: EpisodeRecord) -> float:
        """Return an episode's return."""
        return episode.reward

    def watch(self, episodes: Sequence[EpisodeRecord]) -> None:
        """Learn how long training episodes get; let lessons advance."""
        if self._curriculum is not None:
            self._curriculum.watch(episodes)
        self._longest = max([self._longest, *(episode.steps for episode in episodes)])

    def confirm(self) -> bool:
        """An evaluation is all the proof there is."""
        return True

    def goal_reached(self, episode: EpisodeRecord) -> bool:
        """Tell whether one episode alone met the threshold."""
        return self._threshold is not None and episode.reward >= self._threshold

    def evaluate(self) -> EvaluationResult:
        """Play; keep what was seen. A policy that never comes to an end is cut, or it would be judged for ever."""
        rows = self._world.spec.num_worlds
        each, spare = -(-self._episodes // rows), int(self._judgements > 0)
        patience = max(SHORTEST_PATIENCE, PATIENCE * self._longest)
        recorder = Recorder(self._world.rows_of)
        counted = play_episodes(
            self._policy,
            self._world,
            episodes_each=each,
            spare=spare,
            max_ticks=(each + spare) * patience,
            seed=self._judgements,
            observers=[recorder],
        )
        self._judgements += 1
        save_state(self._file, recorder.rows())
        result = result_of(counted, self._threshold, self._world.rows_of)
        return replace(
            result,
            steps=sum(episode.steps for episode in counted),
            details={**result.details, MAX_STEPS: patience},
        )


class TrainingEpisodesEvaluator:
    """Judges by the training episodes since the judgement before, where no second player can be had."""

    score_name = "return"
    stop_kinds = SCORE

    def __init__(
        self,
        threshold: float | None,
        rows_of: Mapping[str, slice] | None = None,
        curriculum: Curriculum | None = None,
    ) -> None:
        self._curriculum = curriculum
        self._threshold, self._rows_of = threshold, rows_of or {}
        self._told: list[EpisodeRecord] = []
        self._before = EvaluationResult(float("-inf"), False, details={"episodes": 0})

    def score(self, episode: EpisodeRecord) -> float:
        """Return an episode's return."""
        return episode.reward

    def watch(self, episodes: Sequence[EpisodeRecord]) -> None:
        """Keep the episodes for the next evaluation; let lessons advance."""
        if self._curriculum is not None:
            self._curriculum.watch(episodes)
        self._told += episodes

    def confirm(self) -> bool:
        """An evaluation is all the proof there is."""
        return True

    def goal_reached(self, episode: EpisodeRecord) -> bool:
        """Tell whether one episode alone met the threshold."""
        return self._threshold is not None and episode.reward >= self._threshold

    def evaluate(self) -> EvaluationResult:
        """Take the mean; without an episode the judgement before stands."""
        if self._told:
            self._before = result_of(self._told, self._threshold, self._rows_of)
            self._told = []
        return self._before


def result_of(
    episodes: list[EpisodeRecord], threshold: float | None, rows_of: Mapping[str, slice] | None = None
) -> EvaluationResult:
    """Return what episodes came to; of several behaviors the score is the mean of their mean returns.

    Args:
        episodes: What was played.
        threshold: The score that counts as solved; None where none does.
        rows_of: Which worlds belong to which behavior.
    """
    summary = summarise(episodes)
    details: dict[str, Any] = {
        "episodes": summary.episodes,
        "mean_return": summary.mean_reward,
        "std_return": summary.std_reward,
        "mean_steps": summary.mean_steps,
        "cut": sum(episode.status == CUT for episode in episodes),
        "threshold": threshold,
    }
    score = summary.mean_reward
    if rows_of is not None and len(rows_of) > 1:
        each = {
            name: summarise(episode for episode in episodes if rows.start <= episode.world < rows.stop)
            for name, rows in rows_of.items()
        }
        details["behaviors"] = {
            name: {"episodes": result.episodes, "mean_return": result.mean_reward} for name, result in each.items()
        }
        score = details["mean_return"] = float(
            np.mean([result.mean_reward for result in each.values() if result.episodes])
        )
    return EvaluationResult(
        score,
        threshold is not None and score >= threshold,
        threshold is not None and any(episode.reward >= threshold for episode in episodes),
        details=details,
    )


class Recorder:
    """Keeps the first observations that it is shown.

    Args:
        rows_of: Which worlds belong to which behavior; with several, an observation is kept of its behavior's only.
    """

    def __init__(self, rows_of: Mapping[str, slice]) -> None:
        self._rows_of = rows_of if len(rows_of) > 1 else {}
        self._parts: dict[str, list[Array]] = {}
        self._counts: dict[str, int] = {}

    def __call__(self, world: World, buffers: StepBuffers, actions: Array) -> None:
        """Look at what active rows see."""
        for name, values in buffers.observations.items():
            if self._counts.get(name, 0) < OBSERVATIONS_KEPT:
                rows = self._rows_of.get(name.split("/")[0], slice(None))
                part = values[rows][buffers.active[rows]]
                self._parts.setdefault(name, []).append(part)
                self._counts[name] = self._counts.get(name, 0) + len(part)

    def rows(self) -> dict[str, Array]:
        """Return observations by name, (R, …), at most OBSERVATIONS_KEPT."""
        return {name: np.concatenate(parts)[:OBSERVATIONS_KEPT] for name, parts in self._parts.items()}
