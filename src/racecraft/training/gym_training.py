"""Train on any registered Gymnasium environment, on the same loop as the cars. Begin with `train_gym`."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium

from racecraft.algorithms.ppo import PpoLearner
from racecraft.contract.errors import UserInputError, nearest
from racecraft.contract.world import EpisodeRecord
from racecraft.envs.faces.from_gymnasium import GymnasiumWorld
from racecraft.evaluation.episodes import play_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.rollout.statistics import summarise
from racecraft.settings.groups import (
    EvaluationConfig,
    NetworkConfig,
    PpoConfig,
    RolloutConfig,
    RuntimeConfig,
    TrainSettings,
)
from racecraft.settings.overrides import apply_overrides, as_dictionary
from racecraft.training.car_plan import versions
from racecraft.training.events import Listener, Verdict
from racecraft.training.keeping import RunKeeper
from racecraft.training.loop import Outcome, TrainingLoop
from racecraft.training.presets import fit_worlds_to_episodes
from racecraft.training.racing import use_threads
from racecraft.training.stopping import parse_stops

CONFIRMING_EPISODES = 100
"""A score that meets the environment's threshold is confirmed over so many episodes, Gymnasium's own measure."""
JUDGING_WORLDS = 20
SEED_OF_JUDGING = 1_000_000_007

VECTOR_SETTINGS = TrainSettings(
    rollout=RolloutConfig(num_worlds=8, horizon=32),
    network=NetworkConfig(hidden_units=(64, 64), activation="tanh"),
    ppo=PpoConfig(learning_rate=1e-3, discount=0.98, gae_lambda=0.8, epochs=20, batch_size=256, entropy_weight=0.0),
    evaluation=EvaluationConfig(every=8, episodes=20, stable_after=1),
    runtime=RuntimeConfig(threads=1),
)
"""Settings that serve small worlds of vectors. One thread: networks this small only wait for a second one."""


@dataclass(frozen=True)
class GymRequest:
    """What was asked."""

    environment: str
    """A registered id, such as "CartPole-v1"."""
    stops: tuple[str, ...] = ()
    """As typed; none: the environment's own threshold where it has one, and minutes=30."""
    run: Path | None = None
    seed: int = 1
    overrides: tuple[str, ...] = ()


@dataclass(frozen=True)
class TrainedGym:
    """A training that ended, and where it lies."""

    request: GymRequest
    run: RunFolder
    outcome: Outcome

    def summary(self) -> dict[str, Any]:
        """Return the figures of `racecraft gym train --json`."""
        outcome, judged = self.outcome, self.outcome.last
        return {
            "environment": self.request.environment,
            "solved": bool(judged and judged.is_perfect),
            "seconds": round(outcome.seconds, 3),
            "env_steps": outcome.steps,
            "iterations": outcome.iterations,
            "env_steps_per_second": round(outcome.steps / outcome.seconds, 1),
            "evaluation": judged.details if judged else None,
            "stopped_by": outcome.reason,
            "run": str(self.run.path),
            "seed": self.request.seed,
            "versions": versions(),
        }


def train_gym(request: GymRequest, listener: Listener) -> TrainedGym:
    """Train until a stop holds.

    Raises:
        UserInputError: No such environment, a space that cannot be learned, a setting or a stop that is not legal.
    """
    settings = fit_worlds_to_episodes(apply_overrides(VECTOR_SETTINGS, request.overrides), [])
    threshold = reward_threshold(request.environment)
    default_stops = ((f"score={threshold:g}",) if threshold is not None else ()) + ("minutes=30",)
    stops = parse_stops(request.stops or default_stops)
    use_threads(settings.runtime.threads, settings.runtime.device)
    world = GymnasiumWorld(request.environment, settings.rollout.num_worlds)
    job = {
        "kind": "gymnasium",
        "asked": {"environment": request.environment, "stops": [str(stop) for stop in stops]},
        "settings": as_dictionary(settings),
        "seed": request.seed,
        "versions": versions(),
        "started": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()),
    }
    run = _make_run(request, job)
    with run.lock():
        learner = PpoLearner(world.spec, settings.network, settings.ppo, request.seed, settings.runtime.device)
        judge = ReturnJudge(request.environment, GreedyPolicy(learner), settings.evaluation.episodes, threshold)
        collector = Collector(world, learner, settings.rollout.horizon, request.seed)
        card = {"kind": "gymnasium", "environment": request.environment, "settings": as_dictionary(settings)}
        keeper = RunKeeper(run, learner, collector, card)
        loop = TrainingLoop(collector, learner, judge, keeper, listener, settings.rollout, settings.evaluation, stops)
        outcome = loop.run(f"{request.environment}, run {run.path}")
    world.close()
    judge.close()
    return TrainedGym(request, run, outcome)


class ReturnJudge:
    """Judges by the mean return of greedy episodes."""

    score_name = "return"

    def __init__(self, environment: str, policy: GreedyPolicy, episodes: int, threshold: float | None) -> None:
        self._world = GymnasiumWorld(environment, min(episodes, JUDGING_WORLDS))
        self._policy, self._episodes, self._threshold = policy, episodes, threshold

    def score(self, episode: EpisodeRecord) -> float:
        """Return an episode's return."""
        return episode.reward

    def is_full(self, episode: EpisodeRecord) -> bool:
        """Tell whether one episode alone met the threshold."""
        return self._threshold is not None and episode.reward >= self._threshold

    def judge(self) -> Verdict:
        """Play; a mean that meets the threshold is confirmed over CONFIRMING_EPISODES."""
        episodes = self._play(self._episodes, SEED_OF_JUDGING)
        if self._meets(episodes) and len(episodes) < CONFIRMING_EPISODES:
            episodes += self._play(CONFIRMING_EPISODES - len(episodes), SEED_OF_JUDGING + 1)
        summary = summarise(episodes)
        details = {
            "episodes": summary.episodes,
            "mean_return": summary.mean_reward,
            "std_return": summary.std_reward,
            "mean_steps": summary.mean_steps,
            "threshold": self._threshold,
        }
        return Verdict(summary.mean_reward, self._meets(episodes), details=details)

    def close(self) -> None:
        """Close the judged world."""
        self._world.close()

    def _play(self, count: int, seed: int) -> list[EpisodeRecord]:
        each = -(-count // self._world.spec.num_worlds)
        return play_episodes(self._policy, self._world, episodes_each=each, seed=seed)[:count]

    def _meets(self, episodes: list[EpisodeRecord]) -> bool:
        return self._threshold is not None and summarise(episodes).mean_reward >= self._threshold


def reward_threshold(environment: str) -> float | None:
    """Return the mean return at which an environment counts as solved, where its registration says one.

    Raises:
        UserInputError: No such environment.
    """
    try:
        return gymnasium.spec(environment).reward_threshold
    except gymnasium.error.Error as error:
        known = sorted(gymnasium.registry)
        raise UserInputError(
            f"There is no Gymnasium environment '{environment}'. {_hint(environment, known)}"
        ) from error


def _hint(name: str, known: list[str]) -> str:
    hint = nearest(name, known)
    return hint if hint.startswith("Did") else "`import` the package that registers it, or name a built-in one."


def _make_run(request: GymRequest, job: dict[str, Any]) -> RunFolder:
    if request.run is not None:
        return RunFolder.create(request.run, job)
    return RunFolder.create_numbered(Path("runs"), request.environment.replace("/", "-"), job)
