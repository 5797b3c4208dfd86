"""How good a checkpoint is on starts that did not choose it. Begin with `score_on_fresh_starts`.

A training calls that checkpoint the best which did best in its evaluations; judged by the same starts again, it would
look better than it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.contract.kinds import find_kind
from racecraft.evaluation.evaluate_run import JUDGING_WORLDS, MAX_TICKS
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import load_policy
from racecraft.rollout.episodes import play_episodes

EPISODES = 20
SEED = 1_300_000_021
"""Of no training and of no evaluation within one."""


@dataclass(frozen=True)
class FreshScores:
    """What episodes from fresh starts came to."""

    name: str
    """What a score is, with its unit: "lap time, s"."""
    less_is_better: bool
    values: tuple[float, ...]
    """One a start; infinite where the goal was not reached."""
    checkpoint: int
    """The iteration that was judged."""
    fallback: float
    """What seeds are told apart by where most starts reach no goal, more is better: mean progress, per cent."""

    @property
    def score(self) -> float:
        """The score of this seed: of returns the mean, of times the median, infinite where most reached no goal."""
        if not self.less_is_better:
            return float(np.mean(self.values))
        ordered = np.sort(self.values)
        upper = float(ordered[len(ordered) // 2])
        return upper if np.isinf(upper) else float(np.median(ordered))

    @property
    def reached_share(self) -> float:
        """Share of the starts that reached the goal, 0 to 1."""
        return float(np.isfinite(self.values).mean())


def score_on_fresh_starts(run: RunFolder, which: str, episodes: int = EPISODES) -> FreshScores:
    """Judge a checkpoint from so many fresh starts, greedily.

    Args:
        run: The run.
        which: "best", "last", the number of an iteration or a merit.
        episodes: How many starts.

    Raises:
        SettingError: The run's kind of world has no way to do so.
    """
    kind = find_kind(str(run.read_job().get("kind")), str(run.path))
    fresh = kind.piece("fresh_scores")
    if fresh is not None:
        scores: FreshScores = fresh(run, which, episodes)
        return scores
    judging_world = kind.piece("judging_world")
    if judging_world is None:
        raise SettingError(
            "{path}: runs of the kind {name!r} cannot be compared; expected cars, snakes or Gymnasium.",
            path=run.path,
            name=kind.name,
        )
    policy = load_policy(run, which)
    with judging_world(run, min(episodes, JUDGING_WORLDS)) as world:
        each = -(-episodes // (world.spec.num_worlds * world.spec.num_agents))
        records = play_episodes(policy, world, episodes_each=each, seed=SEED, max_ticks=MAX_TICKS)[:episodes]
    returns = tuple(one.reward for one in records)
    return FreshScores("return", False, returns, policy.checkpoint.iteration, float(np.mean(returns)))
