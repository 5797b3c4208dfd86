"""What RLlib says after an iteration, in its names, so that metric definitions go on finding it."""

from __future__ import annotations

import numbers
from collections.abc import Callable, Mapping
from typing import Any

from racecraft.compat.episode_listener import Tally, Told
from racecraft.compat.rllib_callbacks import Callbacks
from racecraft.training.callbacks import IterationReport, NullCallback

NOT_TOLD = ("hist_stats",)
"""What callbacks are told and nobody else: lists of every episode's figures."""


class RllibLines(NullCallback):
    """Says an iteration.

    Args:
        tally: Knows the episodes; None: worlds are elsewhere, and only the mean of an agent is known.
        agents: Says how many agents an episode has; their rewards are added up.
        calls: Is told of each iteration, once an episode has ended; what it lays into the result is said, too.
        episodes: How many the run had before.
        on_policy: Whether every step is learned from in its own iteration, as RLlib counts for PPO.
    """

    def __init__(
        self,
        tally: Tally | None = None,
        agents: Callable[[], int] = lambda: 1,
        calls: Callbacks | None = None,
        episodes: int = 0,
        on_policy: bool = False,
    ) -> None:
        self._told, self._tally, self._agents, self._calls = 0, tally, agents, calls
        self._episodes, self._on_policy = episodes, on_policy
        self._of_episodes: dict[str, Any] = {}

    def iteration(self, report: IterationReport) -> None:
        """Print an iteration; one that is judged afterwards is not said twice."""
        if report.iteration == self._told:
            return
        self._told = report.iteration
        result = self._result(report)
        if self._calls is not None and "hist_stats" in result:
            self._calls.iteration(result)
        for line in _lines({name: value for name, value in result.items() if name not in NOT_TOLD}):
            print(f"  {line}")
        print("", end="", flush=True)

    def _result(self, report: IterationReport) -> dict[str, Any]:
        """Return what RLlib's result would hold; an iteration in which no episode ended has those of the one before."""
        told = self._tally.take() if self._tally is not None else []
        if told:
            self._of_episodes = _of_episodes(told)
            if self._calls is not None:
                self._of_episodes["custom_metrics"] = self._calls.take_metrics()
        ended = round(report.episodes / self._agents()) if self._tally is None else len(told)
        self._episodes += ended
        result = dict(self._of_episodes) if told or self._calls is not None else {}
        if self._tally is None and report.mean_reward is not None:
            result["episode_reward_mean"] = report.mean_reward * self._agents()
        return result | {
            "episodes_this_iter": ended,
            "episodes_total": self._episodes,
            "num_steps_sampled": report.steps,
            **({"num_steps_trained": report.steps} if self._on_policy else {}),
            "time_total_s": round(report.seconds, 3),
            "timesteps_total": report.steps,
            "training_iteration": report.iteration,
        }


def _of_episodes(told: list[Told]) -> dict[str, Any]:
    rewards, steps = [one.reward for one in told], [one.steps for one in told]
    result: dict[str, Any] = {
        "episode_len_mean": sum(steps) / len(steps),
        "episode_reward_max": max(rewards),
        "episode_reward_mean": sum(rewards) / len(rewards),
        "episode_reward_min": min(rewards),
        "hist_stats": {"episode_reward": rewards, "episode_lengths": steps},
    }
    by_policy: dict[str, list[float]] = {}
    for one in told:
        for name, earned in one.by_policy.items():
            by_policy.setdefault(name, []).extend(earned)
    if by_policy:
        for word, of in (("max", max), ("min", min), ("mean", lambda earned: sum(earned) / len(earned))):
            result[f"policy_reward_{word}"] = {name: of(earned) for name, earned in by_policy.items()}
    return result


def _lines(result: Mapping[str, Any], before: str = "") -> list[str]:
    """Return names and figures, those of a part indented; what is no figure is left out."""
    lines: list[str] = []
    for name, value in result.items():
        if isinstance(value, Mapping):
            within = _lines(value, before + "  ")
            lines += [f"{before}{name}:", *within] if within else []
        elif isinstance(value, numbers.Integral) and not isinstance(value, bool):
            lines.append(f"{before}{name}: {int(value)}")
        elif isinstance(value, numbers.Real) and not isinstance(value, bool):
            lines.append(f"{before}{name}: {float(value):.6g}")
    return lines
