"""Judges a policy by the mean return of greedy episodes, in worlds of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from racecraft.contract.policy import Policy
from racecraft.contract.world import EpisodeRecord, World
from racecraft.evaluation.evaluate_run import SEED_OF_JUDGING
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.statistics import summarise
from racecraft.training.callbacks import EvaluationResult
from racecraft.training.stopping import SCORE

SHORTEST_PATIENCE, PATIENCE = 10_000, 3
"""A judged episode may last so many steps, or so many times the longest training episode, whichever is more."""
CONFIRMING_EPISODES = 100
"""A score that meets the threshold is confirmed over so many episodes, Gymnasium's own measure."""


class ReturnEvaluator:
    """Judges by the mean return of greedy episodes.

    Args:
        world: Worlds that are judged in.
        confirming: Worlds that a score is confirmed in; the same, or more of them where more cost no more.
        policy: The judged policy.
        episodes: How many episodes count.
        threshold: The mean return that counts as solved; None where none does.
    """

    score_name = "return"
    stop_kinds = SCORE

    def __init__(self, world: World, confirming: World, policy: Policy, episodes: int, threshold: float | None) -> None:
        self._world, self._confirming, self._policy = world, confirming, policy
        self._episodes, self._threshold = episodes, threshold
        self._longest = 0
        self._poll: Callable[[], None] | None = None

    def set_poll_callback(self, poll: Callable[[], None]) -> None:
        """Have something looked at while episodes are played; what it raises ends an evaluation."""
        self._poll = poll

    def score(self, episode: EpisodeRecord) -> float:
        """Return an episode's return."""
        return episode.reward

    def goal_reached(self, episode: EpisodeRecord) -> bool:
        """Tell whether one episode alone met the threshold."""
        return self._threshold is not None and episode.reward >= self._threshold

    def watch(self, episodes: Sequence[EpisodeRecord]) -> None:
        """Learn how long training episodes get."""
        self._longest = max([self._longest, *(episode.steps for episode in episodes)])

    def evaluate(self) -> EvaluationResult:
        """Play; a mean that meets the threshold is confirmed over CONFIRMING_EPISODES."""
        episodes = self._play(self._world, self._episodes, SEED_OF_JUDGING)
        if self._meets(episodes) and len(episodes) < CONFIRMING_EPISODES:
            episodes += self._play(self._confirming, CONFIRMING_EPISODES - len(episodes), SEED_OF_JUDGING + 1)
        summary = summarise(episodes)
        details = {
            "episodes": summary.episodes,
            "mean_return": summary.mean_reward,
            "std_return": summary.std_reward,
            "mean_steps": summary.mean_steps,
            "threshold": self._threshold,
        }
        reached = any(map(self.goal_reached, episodes))
        steps = sum(episode.steps for episode in episodes)
        return EvaluationResult(summary.mean_reward, self._meets(episodes), reached, details=details, steps=steps)

    def confirm(self) -> bool:
        """An evaluation that meets the threshold is confirmed already."""
        return True

    def _play(self, world: World, count: int, seed: int) -> list[EpisodeRecord]:
        each = -(-count // world.spec.num_worlds)
        patience = max(SHORTEST_PATIENCE, PATIENCE * self._longest)
        return play_episodes(
            self._policy, world, episodes_each=each, seed=seed, max_ticks=each * patience, poll=self._poll
        )[:count]

    def _meets(self, episodes: list[EpisodeRecord]) -> bool:
        return self._threshold is not None and summarise(episodes).mean_reward >= self._threshold
