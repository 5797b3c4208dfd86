"""Judge the greedy policy of a car in training: one episode from each of several starts, side by side.

With fidelity aws every episode of an evaluation begins where training's next one would, and what chance does to its
ticks and wheels is its own.
"""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import EpisodeRecord
from racecraft.envs.deepracer import race
from racecraft.envs.deepracer.world import RaceWorld
from racecraft.evaluation.deepracer.laps import judge_starts
from racecraft.players.trained import GreedyPolicy
from racecraft.training.callbacks import Verdict


class CarJudge:
    """Drives the policy on a world of its own.

    Args:
        world: As many cars as starts; no reward.
        policy: The policy, greedy; it follows its learner.
        trained_in: The training's own world; with fidelity aws, evaluations start where its next episode would.
        best_by: What makes a checkpoint the best: "progress", "reward" or "laptime".
    """

    score_name = "progress %"

    def __init__(
        self,
        world: RaceWorld,
        policy: GreedyPolicy,
        trained_in: RaceWorld | None = None,
        best_by: str = "progress",
    ) -> None:
        self._world, self._policy, self._trained_in, self._best_by = world, policy, trained_in, best_by

    def score(self, episode: EpisodeRecord) -> float:
        """Return the progress of an episode, per cent."""
        return episode.facts["progress_percent"]

    def is_full(self, episode: EpisodeRecord) -> bool:
        """Tell whether an episode was a full lap."""
        return episode.status == race.STATUSES[race.LAP_COMPLETE]

    def judge(self) -> Verdict:
        """Drive from every start."""
        episodes = 0
        if self._trained_in is not None and self._world.habits.evaluation_follows_training:
            self._world.move_starts(np.full(self._world.spec.num_worlds, self._trained_in.next_start_share))
            episodes = self._trained_in.episodes_begun
        report = judge_starts(self._policy, self._world, seed=episodes)
        return Verdict(
            report.mean_progress_percent,
            report.all_full,
            report.best_lap_seconds,
            report.as_dictionary(),
            report.merit(self._best_by),
        )
