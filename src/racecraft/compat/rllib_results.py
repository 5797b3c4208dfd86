"""What RLlib says after an iteration, in its names, so that metric definitions go on finding it."""

from __future__ import annotations

import numbers
from collections.abc import Mapping
from typing import Any

from racecraft.compat.episode_listener import FinishedEpisodes, WatchedEpisode
from racecraft.compat.rllib_callbacks import Callbacks
from racecraft.training.callbacks import IterationReport, NullCallback

NOT_TOLD = ("hist_stats",)
"""What callbacks are told and nobody else: lists of every episode's figures."""


class RllibLines(NullCallback):
    """Says an iteration.

    Args:
        tally: Knows the episodes; None: worlds are elsewhere, and only the mean of an agent is known.
        agents: How many agents an episode has; their rewards are added up, and their steps are one.
        calls: Is told of each iteration, once an episode has ended; what it lays into the result is said, too.
        episodes: How many the run had before.
        on_policy: Whether every step is learned from in its own iteration, as RLlib counts for PPO.
        rollouts: Iterations of ours in one of RLlib's; the others are not told.
        counts_agents: Whether a step is one agent's.
    """

    def __init__(
        self,
        tally: FinishedEpisodes | None = None,
        agents: int = 1,
        calls: Callbacks | None = None,
        episodes: int = 0,
        on_policy: bool = False,
        rollouts: int = 1,
        counts_agents: bool = False,
    ) -> None:
        self._told, self._tally, self._agents, self._calls = 0, tally, agents, calls
        self._rollouts, self._agents_in_a_step = rollouts, 1 if counts_agents else agents
        self._ended, self._earned = 0, 0.0
        self._episodes, self._on_policy = episodes, on_policy
        self._of_episodes: dict[str, Any] = {}

    def iteration(self, report: IterationReport) -> None:
        """Print an iteration; one that is judged afterwards is not said twice."""
        if report.iteration == self._told:
            return
        self._told = report.iteration
        self._ended += report.episodes
        self._earned += report.episodes * (report.mean_reward or 0.0)
        if report.iteration % self._rollouts:
            return
        result = self._result(report)
        if self._calls is not None and "hist_stats" in result:
            self._calls.iteration(result)
        for line in lines({name: value for name, value in result.items() if name not in NOT_TOLD}):
            print(f"  {line}")
        print("", end="", flush=True)

    def _result(self, report: IterationReport) -> dict[str, Any]:
        """Return what RLlib's result would hold; an iteration in which no episode ended has those of the one before."""
        episodes = self._tally.pop() if self._tally is not None else []
        if episodes:
            self._of_episodes = _of_episodes(episodes)
            if self._calls is not None:
                self._of_episodes["custom_metrics"] = self._calls.take_metrics()
        ended = round(self._ended / self._agents) if self._tally is None else len(episodes)
        self._episodes += ended
        result = dict(self._of_episodes) if episodes or self._calls is not None else {}
        if self._tally is None and self._ended:
            result["episode_reward_mean"] = self._earned / self._ended * self._agents
        self._ended, self._earned = 0, 0.0
        steps = report.steps // self._agents_in_a_step
        return result | {
            "episodes_this_iter": ended,
            "episodes_total": self._episodes,
            "num_steps_sampled": steps,
            **({"num_steps_trained": steps} if self._on_policy else {}),
            "time_total_s": round(report.seconds, 3),
            "timesteps_total": steps,
            "training_iteration": report.iteration // self._rollouts,
        }


def _of_episodes(episodes: list[WatchedEpisode]) -> dict[str, Any]:
    rewards, steps = [one.reward for one in episodes], [one.steps for one in episodes]
    result: dict[str, Any] = {
        "episode_len_mean": sum(steps) / len(steps),
        "episode_reward_max": max(rewards),
        "episode_reward_mean": sum(rewards) / len(rewards),
        "episode_reward_min": min(rewards),
        "hist_stats": {"episode_reward": rewards, "episode_lengths": steps},
    }
    by_policy: dict[str, list[float]] = {}
    for one in episodes:
        for name, earned in one.by_policy.items():
            by_policy.setdefault(name, []).extend(earned)
    if by_policy:
        for word, of in (("max", max), ("min", min), ("mean", lambda earned: sum(earned) / len(earned))):
            result[f"policy_reward_{word}"] = {name: of(earned) for name, earned in by_policy.items()}
    return result


def lines(result: Mapping[str, Any], before: str = "") -> list[str]:
    """Return names and figures, those of a part indented; what is no figure is left out."""
    printed: list[str] = []
    for name, value in result.items():
        if isinstance(value, Mapping):
            within = lines(value, before + "  ")
            printed += [f"{before}{name}:", *within] if within else []
        elif isinstance(value, numbers.Integral) and not isinstance(value, bool):
            printed.append(f"{before}{name}: {int(value)}")
        elif isinstance(value, numbers.Real) and not isinstance(value, bool):
            printed.append(f"{before}{name}: {float(value):.6g}")
    return printed
