"""Judge the greedy policy of a car in training: one episode from each of several starts, side by side.

With fidelity aws every episode of an evaluation begins where training's next one would. Our world has no jitter and a
greedy policy no dice, so those episodes are one and the same, tick by tick: it is driven once and counted as often as
it was asked for.
"""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import EpisodeRecord
from racecraft.envs.deepracer import race
from racecraft.envs.deepracer.fidelity import Habits
from racecraft.envs.deepracer.world import RaceWorld
from racecraft.evaluation.laps import LapReport, judge_starts
from racecraft.players.trained import GreedyPolicy
from racecraft.training.events import Verdict


def episodes_begin_alike(habits: Habits) -> bool:
    """Tell whether all episodes of an evaluation start where training's next one would."""
    return habits.evaluation_follows_training


class CarJudge:
    """Drives the policy on a world of its own.

    Args:
        world: As many cars as starts; no reward.
        policy: The policy, greedy; it follows its learner.
        trained_in: The training's own world; with fidelity aws, evaluations start where its next episode would.
        best_by: What makes a checkpoint the best: "progress", "reward" or "laptime".
        trials: How often an episode counts that begins where all others do.
    """

    score_name = "progress %"

    def __init__(
        self,
        world: RaceWorld,
        policy: GreedyPolicy,
        trained_in: RaceWorld | None = None,
        best_by: str = "progress",
        trials: int = 1,
    ) -> None:
        self._world, self._policy, self._trained_in = world, policy, trained_in
        self._best_by, self._trials = best_by, trials

    def score(self, episode: EpisodeRecord) -> float:
        """Return the progress of an episode, per cent."""
        return episode.facts["progress_percent"]

    def is_full(self, episode: EpisodeRecord) -> bool:
        """Tell whether an episode was a full lap."""
        return episode.status == race.STATUSES[race.LAP_COMPLETE]

    def judge(self) -> Verdict:
        """Drive from every start."""
        if self._trained_in is not None and episodes_begin_alike(self._world.habits):
            self._world.move_starts(np.full(self._world.spec.num_worlds, self._trained_in.next_start_share))
        report = LapReport(judge_starts(self._policy, self._world).laps * self._trials)
        return Verdict(
            report.mean_progress_percent,
            report.all_full,
            report.best_lap_seconds,
            report.as_dictionary(),
            report.merit(self._best_by),
        )
