"""Judge the greedy policy of a car in training: one episode from each of several starts, side by side.

With fidelity aws every episode of an evaluation begins where training's next one would, and what chance does to its
ticks and wheels is its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import EpisodeRecord
from racecraft.envs.deepracer import race
from racecraft.envs.deepracer.side_by_side import SideBySide
from racecraft.envs.deepracer.world import RaceWorld
from racecraft.evaluation.deepracer.laps import judge_laps, judge_starts
from racecraft.training.callbacks import EvaluationResult
from racecraft.training.stopping import LAPS

FLYING_LAPS = 3
"""Laps in a row that a policy drives before it is called stable."""


class CarEvaluator:
    """Drives the policy on a world of its own.

    Args:
        world: As many cars as starts; no reward.
        policy: The policy, greedy; it follows its learner.
        trained_in: The training's own world; with fidelity aws, evaluations start where its next episode would.
        best_by: What makes a checkpoint the best: "progress", "reward" or "laptime"; of equals the faster.
        flying: One car that drives FLYING_LAPS laps in one episode, to confirm that it is stable; None: no such proof.
    """

    score_name = "progress %"
    stop_kinds = LAPS

    def __init__(
        self,
        world: RaceWorld | SideBySide,
        policy: Policy,
        trained_in: RaceWorld | SideBySide | None = None,
        best_by: str = "progress",
        flying: RaceWorld | None = None,
    ) -> None:
        self._world, self._policy, self._trained_in, self._best_by = world, policy, trained_in, best_by
        self._flying = flying

    def score(self, episode: EpisodeRecord) -> float:
        """Return the progress of an episode, per cent."""
        return episode.facts["progress_percent"]

    def goal_reached(self, episode: EpisodeRecord) -> bool:
        """Tell whether an episode was a full lap."""
        return episode.status == race.STATUSES[race.LAP_COMPLETE]

    def watch(self, episodes: Sequence[EpisodeRecord]) -> None:
        """Training's episodes change nothing here."""

    def evaluate(self) -> EvaluationResult:
        """Drive from every start."""
        episodes = 0
        if self._trained_in is not None and self._world.habits.evaluation_follows_training:
            self._world.move_starts(np.full(self._world.spec.num_worlds, self._trained_in.next_start_share))
            episodes = self._trained_in.episodes_begun
        report = judge_starts(self._policy, self._world, seed=episodes)
        best = report.best_lap_seconds
        return EvaluationResult(
            report.mean_progress_percent,
            report.all_full,
            goal_reached=best is not None,
            figures={"best_lap_seconds": best},
            headline="" if best is None else f"best lap {best:.2f} s",
            details=report.as_dictionary(),
            steps=sum(lap.steps for lap in report.laps),
            selection=(report.merit(self._best_by), -float("inf") if best is None else -best),
        )

    def confirm(self) -> bool:
        """Drive three laps one after the other: what laps from every start need not survive its own finish line."""
        if self._flying is None:
            return True
        return judge_laps(self._policy, self._flying, FLYING_LAPS).all_full
